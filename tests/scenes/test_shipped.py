"""Models that come with the program: packed and unpacked without harm, and those of today's law.

Where a test of what is shipped fails, run `python -m tools.shipped_models` and commit what it writes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mechanics.compliance import compliance_file, compliance_key, load_or_condense
from mechanics.errors import FileError
from mechanics.model import Model
from mechanics.model_files import read_model, write_model
from palpate.warm_up import block_renderer
from render.fem import FemRenderer
from scenes import shipped

MAKE = "what is shipped is not what this program makes: run 'python -m tools.shipped_models' and commit it"
MOST_BYTES = 15_000_000


@pytest.fixture(scope="module")
def packed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Model, Path]:
    """A block's model with its compliance, and its archive."""
    folder = tmp_path_factory.mktemp("packed")
    block = block_renderer().model
    model = block.replaced(path=write_model(folder / "block", block))
    archive = folder / "block-0123.zip"
    shipped.pack(model.path, archive, load_or_condense(model), compliance_key(model))
    return model, archive


def test_what_is_unpacked_is_the_model_and_its_compliance(packed: tuple[Model, Path], tmp_path: Path) -> None:
    model, archive = packed
    shipped.unpack(archive, tmp_path / "block")
    unpacked = read_model(tmp_path / "block")
    assert (tmp_path / "block" / compliance_file(compliance_key(unpacked))).is_file()
    assert np.array_equal(unpacked.mesh.points, model.mesh.points)
    before, after = load_or_condense(model).arrays(), load_or_condense(unpacked).arrays()
    for name in before.keys() - {"blocks"}:
        assert np.array_equal(before[name], after[name]), name
    blocks = after["blocks"]
    assert np.array_equal(blocks, blocks.transpose(1, 0, 3, 2))


def test_packing_moves_no_force_of_one_tip_and_little_of_three(
    packed: tuple[Model, Path], tmp_path: Path
) -> None:
    model, archive = packed
    shipped.unpack(archive, tmp_path / "block")
    plain, unpacked = FemRenderer(model), FemRenderer(read_model(tmp_path / "block"))
    tips = np.array([[0.0, 0.0, 0.015], [0.003, 0.003, 0.0145], [-0.003, 0.002, 0.0145]])
    path = tips + np.linspace(4e-3, 0.0, 9)[:, None, None] * [0.0, 0.0, 1.0]
    for count in (1, 3):
        down, steps_s = path[:, :count], np.full(len(path), 0.01)
        forces = [each.follow(each.start([0.005] * count), down, steps_s)[-1] for each in (plain, unpacked)]
        size = np.linalg.norm(forces[0], axis=1)
        off = np.linalg.norm(forces[1] - forces[0], axis=1)
        assert (size > 0).all()
        assert (off <= (0.0 if count == 1 else 1e-3) * size).all()


def test_a_damaged_archive_is_an_error_of_one_line(packed: tuple[Model, Path], tmp_path: Path) -> None:
    cut = tmp_path / "cut.zip"
    cut.write_bytes(packed[1].read_bytes()[:2000])
    with pytest.raises(FileError, match="damaged"):
        shipped.unpack(cut, tmp_path / "cut")
    assert not (tmp_path / "cut").exists()
