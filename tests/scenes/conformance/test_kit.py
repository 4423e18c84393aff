"""The kit: its truth, its flaws, and a score that needs numpy alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from palpate.cli import main
from palpate.mechanics.errors import FileError
from palpate.operations.conformance import conformance
from palpate.scenes.conformance import kit as kits
from palpate.scenes.conformance.cases import BODIES, FRICTION, SHARES, SLIP_SHARE, TIP_M, pressed
from palpate.scenes.conformance.flaws import FLAWS
from palpate.scenes.conformance.truth import cases, hertz, mindlin

MOST_BYTES, MOST_SHIPPED_BYTES, MOST_LINES = 20_000_000, 2_000_000, 80


@pytest.fixture(scope="module")
def kit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A kit as the command writes it."""
    folder = tmp_path_factory.mktemp("conformance") / "kit"
    assert main(["conformance", "-o", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def right(kit: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The true forces as a simulator would write them."""
    folder = tmp_path_factory.mktemp("right")
    for file in (kit / "truth").glob("*.csv"):
        lines = [",".join(line.split(",")[:4]) for line in file.read_text().splitlines()]
        (folder / file.name).write_text("\n".join(lines) + "\n")
    return folder


def scored(kit: Path, forces: Path, *more: str) -> subprocess.CompletedProcess[str]:
    """`score.py` in a process that finds numpy and nothing else of ours."""
    numpy_home = str(Path(np.__file__).parents[1])
    block = (
        "import sys, runpy\n"
        "class No:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.split('.')[0] in ('palpate', 'scipy', 'numba', 'matplotlib', 'pandas'):\n"
        "            raise ImportError(name)\n"
        f"sys.meta_path.insert(0, No()); sys.path.append({numpy_home!r})\n"
        "sys.argv = sys.argv[1:]; runpy.run_path(sys.argv[0], run_name='__main__')\n"
    )
    words = [sys.executable, "-I", "-S", "-c", block, str(kit / "score.py"), str(forces), *more]
    return subprocess.run(words, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": ""})


def number(done: subprocess.CompletedProcess[str]) -> float:
    """The last line."""
    assert done.returncode == 0, done.stderr
    return float(done.stdout.strip().splitlines()[-1])


def test_the_truth_scores_one_and_every_flaw_less_the_same_each_time(kit: Path, right: Path) -> None:
    assert number(scored(kit, right)) == number(scored(kit, kit / "truth")) == 1.0
    assert len(FLAWS) == 9
    for flaw in FLAWS:
        once = scored(kit, kit / "examples" / flaw)
        assert number(once) < 0.95, flaw
    assert scored(kit, kit / "examples" / flaw).stdout == once.stdout


def test_a_score_that_fell_and_a_case_that_is_gone_fail_a_build(
    kit: Path, right: Path, tmp_path: Path
) -> None:
    stiff = kit / "examples" / next(iter(FLAWS))
    score = number(scored(kit, stiff))
    assert scored(kit, stiff, "--at-least", f"{score - 0.01}").returncode == 0
    assert scored(kit, stiff, "--at-least", f"{score + 0.01}").returncode == 1
    for file in list(right.glob("*.csv"))[1:]:
        (tmp_path / file.name).write_bytes(file.read_bytes())
    assert scored(kit, tmp_path).returncode == 0
    assert scored(kit, tmp_path, "--at-least", "0").returncode == 1
    assert scored(kit, right, "--at-least", "5").returncode == 2


def test_a_kit_is_small_the_same_every_time_and_knows_nothing_of_palpate(kit: Path, tmp_path: Path) -> None:
    again = conformance(tmp_path / "again", progress=False)
    files = {p.relative_to(kit): p.read_bytes() for p in kit.rglob("*") if p.is_file()}
    assert {p.relative_to(again.path): p.read_bytes() for p in again.path.rglob("*") if p.is_file()} == files
    assert sum(map(len, files.values())) == again.size_bytes < MOST_BYTES
    assert json.loads(files[Path("kit.json")])["version"] == again.version
    for name, data in files.items():
        if name.suffix == ".py":
            assert b"import palpate" not in data and b"from palpate" not in data, name
        if name.name.startswith("run_"):
            assert len(data.splitlines()) <= MOST_LINES, name
    shipped = (Path(kits.__file__).parent / "solved").glob("*.npz")
    assert sum(p.stat().st_size for p in shipped) < MOST_SHIPPED_BYTES


def test_the_example_of_a_ci_job_is_yaml_and_calls_files_of_the_kit(kit: Path) -> None:
    yaml = pytest.importorskip("yaml")
    job = yaml.safe_load((kit / "ci.yml").read_text())["jobs"]["score"]
    commands = [step["run"].split() for step in job["steps"] if "run" in step]
    called = [words[1] for words in commands if words[0] == "python"]
    assert called and all((kit.parent / name).is_file() for name in called)
    assert "--at-least" in commands[-1]


def test_bodies_are_sound_and_say_the_same_in_each_format(kit: Path) -> None:
    import pyvista

    for body in BODIES:
        with np.load(kit / "bodies" / f"{body.name}.npz") as stored:
            points, cells, fixed = (stored[key] for key in ("points", "tetrahedra", "fixed"))
        corner = points[cells]
        volumes = np.linalg.det(corner[:, 1:] - corner[:, :1]) / 6
        assert (volumes > 0).all()
        np.testing.assert_array_equal(np.flatnonzero(points[:, 2] < 1e-9), fixed)
        grid = pyvista.read(kit / "bodies" / f"{body.name}.vtu")
        np.testing.assert_allclose(grid.points, points, atol=1e-7)
        np.testing.assert_array_equal(grid.cells_dict[10], cells)
        np.testing.assert_array_equal(np.flatnonzero(grid.point_data["fixed"]), fixed)
        shell = pyvista.read(kit / "bodies" / f"{body.name}.stl")
        assert shell.is_manifold
        assert shell.volume == pytest.approx(volumes.sum(), rel=1e-4)


def test_a_tip_touches_each_body_where_its_path_says() -> None:
    for tips in cases().values():
        for tip in tips:
            gap = np.linalg.norm(tip.body.solved.points - tip.centre[0], axis=1).min() - TIP_M
            assert 0 < gap < 1e-3, tip.name
            felt = tip.force.any(axis=1)
            if len(tips) == 1:  # a second tip pushes the surface away from under the first
                np.testing.assert_array_equal(felt, tip.way[:, 0] > 0)
            assert (tip.bound > 0).all()
            assert np.median(tip.bound[felt] / np.linalg.norm(tip.force[felt], axis=1)) < 0.06


def test_the_half_space_by_two_solvers_is_closed_form_within_its_bound() -> None:
    body, tip = BODIES[0], cases()["half-space"][0]
    depth = SHARES * body.depth_m
    force = pressed(body, depth) @ body.solved.normal
    assert np.abs(force / hertz(depth) - 1).max() < 0.02
    press = tip.way[:, 1] == 0
    off = np.linalg.norm(pressed(body, tip.way[:, 0]) - tip.force, axis=2)[:, press]
    assert (off <= tip.bound[press]).all()
    # the solved tip that sticks is held back as Mindlin's is before it slips
    stuck = (body.solved.force[:, -1] - body.solved.force[:, -2]) @ -body.solved.along
    way = np.array([0.05 * body.depth_m])
    held = mindlin(np.array([1e3]), np.array([body.depth_m]), way)[0]
    np.testing.assert_allclose(stuck, held, rtol=SLIP_SHARE)


def test_a_slide_ends_on_the_cone_of_friction() -> None:
    tip = cases()["half-space"][0]
    push, aside = tip.force[-1] @ tip.body.solved.normal, -tip.force[-1] @ tip.body.solved.along
    assert aside == pytest.approx(FRICTION * push, rel=1e-6)


def test_two_tips_push_less_than_one_alone_does() -> None:
    a, b = cases()["two-tips"]
    np.testing.assert_allclose(a.force[-1], b.force[-1], atol=1e-9)
    share = a.force[-1, 2] / hertz(np.array([a.body.depth_m]))[0]
    assert 0.85 < share < 0.97


@pytest.mark.parametrize(
    ("spoil", "word"),
    [
        (lambda folder: [p.unlink() for p in folder.glob("*.csv")], "holds none of"),
        (lambda folder: (folder / "slab.csv").write_text("t,x,y,z\n0,0,0,0\n"), "first line must be"),
        (lambda folder: (folder / "slab.csv").write_text("t,fx,fy,fz\n0,0,0\n"), "must be 4 numbers"),
        (lambda folder: (folder / "slab.csv").write_text("t,fx,fy,fz\n0,0,0,0\n"), "its path runs from"),
        (lambda folder: (folder / "slab.csv").write_text("t,fx,fy,fz\n1,0,0,0\n0,0,0,0\n"), "increase"),
    ],
)
def test_a_file_that_cannot_be_scored_is_one_line_and_exit_2(
    kit: Path, right: Path, tmp_path: Path, spoil, word: str
) -> None:
    for file in right.glob("*.csv"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    spoil(tmp_path)
    done = scored(kit, tmp_path)
    assert done.returncode == 2 and not done.stdout
    assert len(done.stderr.strip().splitlines()) == 1 and word in done.stderr


def test_what_is_missing_or_no_number_is_said_and_counts_as_wrong(
    kit: Path, right: Path, tmp_path: Path
) -> None:
    for file in right.glob("*.csv"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / "two-tips-b.csv").unlink()
    lines = (tmp_path / "slab.csv").read_text().splitlines()
    lines[100] = f"{lines[100].split(',')[0]},nan,0,0"
    (tmp_path / "slab.csv").write_text("\n".join(lines))
    page = tmp_path / "page.html"
    done = scored(kit, tmp_path, "--html", str(page))
    assert 0.8 < number(done) < 6 / 7
    assert "no two-tips-b.csv" in done.stdout and "samples of slab are no numbers" in done.stdout
    assert page.read_text().count("<svg") == 8 and "http" not in page.read_text()


def test_a_changed_truth_is_refused(tmp_path: Path, right: Path) -> None:
    made = conformance(tmp_path / "kit", progress=False)
    truth = made.path / "truth" / "slab.csv"
    truth.write_text(truth.read_text().replace("0.1", "0.2", 1))
    done = scored(made.path, right)
    assert done.returncode == 2 and "slab.csv" in done.stderr


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(FileError):
        conformance(tmp_path, progress=False)
    assert (tmp_path / "mine.txt").read_text() == "mine"
