"""Models that come with the program: packed and unpacked without harm, and those of today's law.

Where a test of what is shipped fails, run `python -m tools.shipped_models` and commit what it writes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from palpate.mechanics.compliance.stored_compliance import compliance_file, compliance_key, load_or_condense
from palpate.mechanics.errors import FileError, ModelError, PalpateWarning, SceneError
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress
from palpate.mechanics.shape.tetmesh import box_mesh
from palpate.render.fem.renderer import FemRenderer
from palpate.scenes import build, shipped
from palpate.scenes.scene import Scene, load_scene
from palpate.warm_up import block_renderer

MAKE = "what is shipped is not what this program makes: run 'python -m tools.shipped_models' and commit it"
MOST_BYTES = 15_000_000


@pytest.fixture(scope="module")
def packed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Model, Path]:
    """A block's model with its compliance, and its archive."""
    folder = tmp_path_factory.mktemp("packed")
    block = block_renderer().model.replaced(mesh=box_mesh((2, 2, 2), (0.012,) * 3).quadratic())
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
    whole, cut = packed[1].read_bytes(), tmp_path / "cut.zip"
    random = np.random.default_rng(3)
    for _ in range(20):
        data = bytearray(whole)
        at = int(random.integers(len(data) - 40))
        data[at : at + 40] = random.bytes(40)
        cut.write_bytes(data)
        with pytest.raises(shipped.DamagedError, match="damaged") as told:
            shipped.unpack(cut, tmp_path / "cut")
        assert len(str(told.value).splitlines()) == 1
        assert not (tmp_path / "cut").exists()
    cut.write_bytes(whole[:2000])
    with pytest.raises(FileError, match="damaged"):
        shipped.unpack(cut, tmp_path / "cut")
    assert not (tmp_path / "cut").exists()


def test_a_damaged_archive_is_said_and_its_model_made_anew(
    packed: tuple[Model, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []

    def maker(scene: Scene, progress: Progress) -> Model:
        made.append(scene.name)
        return packed[0].replaced(path=None)

    cut = tmp_path / "cut.zip"
    cut.write_bytes(packed[1].read_bytes()[:2000])
    scene = load_scene("demo")
    monkeypatch.setitem(build._MAKERS, scene.kind, maker)
    monkeypatch.setattr(build, "shipped_model", lambda name: cut)
    with pytest.warns(PalpateWarning, match=r"cut.zip' is damaged .*; the model is made anew") as told:
        model = build.model_of(scene, cache=tmp_path / "cache")
    assert made == ["demo"] and len(told) == 1
    assert np.array_equal(model.mesh.points, packed[0].mesh.points)
    build.model_of(scene, cache=tmp_path / "cache")  # which is kept, and says nothing more
    assert made == ["demo"]


def test_a_damaged_folder_of_the_cache_is_unpacked_again(
    packed: tuple[Model, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def maker(scene: Scene, progress: Progress) -> Model:
        raise AssertionError("what is shipped need not be made")

    scene = load_scene("demo")
    monkeypatch.setitem(build._MAKERS, scene.kind, maker)
    monkeypatch.setattr(build, "shipped_model", lambda name: packed[1])
    path = build.model_of(scene, cache=tmp_path).path
    assert path is not None
    (path / "mesh.vtu").write_bytes(b"nothing")
    again = build.model_of(scene, cache=tmp_path)
    assert np.array_equal(again.mesh.points, packed[0].mesh.points)


def test_a_folder_that_is_not_there_is_called_missing(tmp_path):
    with pytest.raises(SceneError, match="no file or folder .*M1"):
        load_scene(tmp_path / "M1")
    (tmp_path / "M1").write_text("")
    with pytest.raises(SceneError) as told:
        load_scene(tmp_path / "M1")
    assert "no file or folder" not in str(told.value)


def test_what_lies_beside_or_in_a_model_names_it(tmp_path):
    """A report, a part of a MODEL, and the folder around it: each was refused without a word of the MODEL."""
    (tmp_path / "demo" / "model").mkdir(parents=True)
    part, report = tmp_path / "demo" / "model" / "model.toml", tmp_path / "demo" / "report.html"
    part.write_text("format = 1")
    report.write_text("<html></html>")
    for path in (part, report):
        with pytest.raises(SceneError, match=r"demo/model\b(?!/)"):
            load_scene(path)
    with pytest.raises(ModelError, match="demo/model' is one"):
        read_model(load_scene(tmp_path / "demo").source)
