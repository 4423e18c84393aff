"""Every code block of the guide runs, from an empty folder, as it stands; or a test or an essay that is named
here does the same at its own pace."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import palpate as pp
from palpate import cli
from tests.reconstruct.flat_ground import raster
from tests.shell.importing.test_meaning import press, write
from tests.support.waiting import eventually

REPOSITORY = Path(__file__).resolve().parents[2]
DOCS = REPOSITORY / "docs"
GUIDE = [p for folder in ("tutorials", "howto") for p in sorted((DOCS / folder).glob("*.md"))]
GUIDE.append(DOCS / "reference" / "conformance.md")
OTHERS = ("pip", "dask", "python3", "source", ".venv/bin/python", ".venv/bin/palpate")
"""Other programs; of them CI runs what installs and starts this one."""


def nothing(folder: Path) -> None:
    """The page's MODEL is a scene that is there already."""


def a_recording(folder: Path) -> None:
    pp.read_recording("silicone-1-cylinder").save(folder / "REC.csv")


def a_robots_table(folder: Path) -> None:
    """The embedded recording as another program wrote it: mm, and the force on the object."""
    seen = pp.read_recording("silicone-1-cylinder")
    rows = np.column_stack([seen.t, 1e3 * seen.position, -seen.force_on_tool])[::2]
    np.savetxt(folder / "robot.csv", rows, "%.5f", ",", header="time,x_mm,y_mm,z_mm,Fx,Fy,Fz", comments="")


def an_array(folder: Path) -> None:
    t = np.arange(2000) / 200
    deep = 0.006 * np.sin(np.pi * t) ** 2 - 0.001
    force = 400 * np.maximum(deep, 0)
    rows = [t, 10 * np.floor(t), 0 * t, -1e3 * deep, 0 * t, 0 * t, force]
    np.save(folder / "log.npy", np.column_stack(rows))


def a_dent(folder: Path) -> None:
    t, depth, force = press()
    for name in ("dent", "curve1", "curve2", "piece1", "piece2", "FILE"):
        write(folder / f"{name}.csv", [t, 12 - 1e3 * depth, -force], "Time (s),Height (mm),Load (N)")


def a_palpation(folder: Path) -> None:
    """A robot's presses on something flat."""
    seen = raster((4, 4))
    rows = [seen.t, 1e3 * seen.position, seen.force_on_tool]
    write(folder / "palpation.csv", rows, "t [s],x [mm],y [mm],z [mm],fx [N],fy [N],fz [N]")


def a_part(folder: Path) -> None:
    """As parts come: in mm, turned, and far from the file's origin."""
    import trimesh

    part = trimesh.creation.box((60, 60, 30)).apply_translation((0, 0, 15))
    turned = trimesh.transformations.rotation_matrix(np.radians(30), (0, 0, 1))
    part.apply_transform(turned).apply_translation((120, -80, 35)).export(folder / "part.stl")


RUN: dict[str, Callable[[Path], None]] = {
    "howto/arrays.md": an_array,
    "howto/cad-or-scan.md": a_part,
    "howto/check-a-recording.md": a_recording,
    "howto/device.md": nothing,
    "howto/export.md": nothing,
    "howto/force-test.md": nothing,
    "howto/machine-curves.md": a_dent,
    "howto/open-anything.md": a_dent,
    "howto/own-data.md": a_robots_table,
    "howto/press-a-page.md": nothing,
    "howto/robot-log.md": a_palpation,
    "howto/write-a-device.md": nothing,
    "reference/conformance.md": nothing,
}
"""Page: what makes the files that its commands name."""
EVERY_DAY = ("howto/device.md", "howto/robot-log.md", "reference/conformance.md")
"""Pages whose commands take some seconds each."""
CHEAPLY = {"MODEL": "demo", "REC": "REC.csv", "FILE...": "FILE.csv", "dent.csv": "dent.csv --fast"}
WIDELY = {"material": ["--fast", "--travel", "out"]}
"""What is said beside, so that a stand-in costs little: fewer effects."""
ELSEWHERE = {
    "palpate demo": ".ci/run",
    "palpate batch": "tests/shell/batch/test_batch_recordings.py",
    "palpate calibrate": "tests/reconstruct/test_calibration.py",
    "palpate check REC --full": "tests/shell/test_check_command.py",
    "palpate compare before.csv.gz": "tests/diagnose/compare",
    "palpate compare silicone-1-cylinder": "tests/diagnose/compare",
    "palpate diagnose": "examples/plot_05_a_slow_sensor.py",
    "palpate explore": "tests/diagnose/explore",
    "palpate import bag_folder": "tests/shell/importing/test_import.py",
    "palpate material FILE...": "tests/diagnose/specimen",
    "palpate material dent.xlsx": "tests/shell/importing/test_sheets.py",
    "palpate open FILE...": "tests/shell/operations/test_open.py",
    "palpate open palpation.csv --tip-radius 0.004 --shape": "tests/reconstruct/test_known_geometry.py",
    "palpate reconstruct": "tests/reconstruct/test_command.py",
    "palpate simulate": "tests/scenes/laboratory",
    "palpate tune": "tests/diagnose/test_tuning.py",
    "palpate touch": "tests/shell/window/test_touch_command.py",
    "eval": "tests/shell/test_help.py",
    "howto/batch.md python": "examples/plot_13_a_batch.py",
    "howto/cad-or-scan.md python": "examples/plot_10_your_own_mesh.py",
    "howto/force-test.md python": "tests/shell/operations/test_results.py",
    "howto/guided-exploration.md python": "tests/diagnose/explore",
    "howto/python.md python": "tests/shell/operations/test_snippets.py",
    "howto/write-an-effect.md python": "examples/plot_11_write_an_effect.py",
    "howto/wrong-simulation.md python": "tests/diagnose/test_simulated.py",
}
"""What takes minutes, a window or a device: how it begins, and what does the same."""


def lines_of(page: Path) -> list[str]:
    """The lines of a page's shell blocks, joined where one goes on in the next, without remarks."""
    blocks = re.findall(r"^```sh\n(.*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    joined = "".join(blocks).replace("\\\n", " ").splitlines()
    return [re.sub(r"\s+#\s.*", "", line).strip() for line in joined if line.strip()]


def code_of(page: Path) -> list[str]:
    """The Python blocks of a page."""
    return re.findall(r"^```python\n(.*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE)


def name_of(page: Path) -> str:
    return str(page.relative_to(DOCS))


def elsewhere(words: str) -> str | None:
    """What does the same as a line; None for a line that runs here."""
    fitting = [begin for begin in ELSEWHERE if words.startswith(begin)]
    return ELSEWHERE[max(fitting, key=len)] if fitting else None


@pytest.mark.parametrize("page", GUIDE, ids=name_of)
def test_every_block_is_run_here_or_where_it_is_said(page):
    for line in lines_of(page):
        other = line.split()[0] in OTHERS or line.startswith("python -m pip ")
        assert other or elsewhere(line) or name_of(page) in RUN, f"nothing runs '{line}'"
    text = page.read_text("utf-8")
    if code_of(page):
        whole = len(re.findall(r"<!-- run: [\w-]+ -->", text)) > 0 or name_of(page) in PAGES_OF_CODE
        assert whole or f"{name_of(page)} python" in ELSEWHERE, "nothing runs its Python"


def test_what_does_the_same_is_there():
    assert all((REPOSITORY / path).exists() for path in ELSEWHERE.values())


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(
            p, id=name_of(p), marks=pytest.mark.slow if name_of(p) in EVERY_DAY else pytest.mark.release
        )
        for p in GUIDE
        if name_of(p) in RUN
    ],
)
def test_the_commands_of_a_page_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    RUN[name_of(page)](tmp_path)
    done = 0
    for line in lines_of(page):
        if not line.startswith("palpate ") or elsewhere(line):
            continue
        words = shlex.split(line)[1:]
        words = [each for word in words for each in CHEAPLY.get(word, word).split(" ")]
        words = [
            str(each) for word in words for each in (sorted(Path().glob(word)) if "*" in word else [word])
        ]
        code = cli.main([*words, *WIDELY.get(words[0], [])])
        assert code == 0, line
        done += 1
    assert done, "a page that is run has at least one command that runs"


PAGES_OF_CODE = {"howto/write-a-device.md"}


def test_the_device_of_its_page_gives_a_position_and_takes_a_force(monkeypatch):
    from types import ModuleType

    module = ModuleType("palpate.devices.handle")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    exec(compile(code_of(DOCS / "howto" / "write-a-device.md")[0], "handle.py", "exec"), module.__dict__)
    assert [each.present for each in module.find()] == [True]
    with module.make() as device:
        assert eventually(lambda: device.read().calibrated)
        device.enable_force()
        device.send_force(np.array([0.0, 0.0, 1.0]))
        assert np.isfinite(device.read().position_m).all()
    wire = module.HandleWire(module.HandleOptions())
    wire.connect()
    low = min(wire.exchange(None, 0.01).position_m[2] for _ in range(250))
    assert low < -0.03, "the hand reaches the object, whose top lies 30 mm below the device's origin"


def test_the_bench_of_that_page_moves_feels_and_unplugs(monkeypatch):
    from types import ModuleType

    module = ModuleType("palpate.devices.handle")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    driver, bench = code_of(DOCS / "howto" / "write-a-device.md")
    exec(compile(driver, "handle.py", "exec"), module.__dict__)
    names = {"Bench": object}
    exec(compile(bench, "benches.py", "exec"), names)
    made, push = names["HandleBench"](), np.array([0.0, 0.0, 1.0])

    def felt() -> bool:
        made.device.send_force(push)
        return bool(np.array_equal(made.felt(), push))

    with made.device as device:
        made.move([0.01, 0.0, 0.0])
        assert eventually(lambda: device.read().position_m[0] == 0.01)
        device.enable_force()
        assert eventually(felt)
        made.unplug()
        assert eventually(lambda: not made.felt().any() and not device.read().connected)
