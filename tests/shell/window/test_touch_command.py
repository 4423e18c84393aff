"""`palpate touch` without a window, its words where it cannot, and with a real window on a virtual screen."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from ctypes.util import find_library
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import palpate as pp
from palpate.cli import main
from palpate.mechanics.model.files import write_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import read_recording
from palpate.window.base_tracing import BaseTracing

from ...support.waiting import PATIENCE_S, eventually


def test_headless_session_with_a_recording(
    block: Model, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    path = tmp_path / "session.csv.gz"
    words = ["touch", str(block.path), "--headless", "--seconds", "4", "--record", str(path), "--json", "-"]
    assert main([*words, "--jump", "0.01"]) == 0
    out, err = capsys.readouterr()
    result = json.loads(out)
    loosened = "protection loosened: --jump is 0.01 (default 0.005)"
    assert loosened in err and loosened in result["servo"]["words"]
    servo = result["servo"]
    assert result["device"] == "simulated" and servo["ticks"] > 0
    # of the four seconds' deadlines a busy machine misses some, and counts them
    assert servo["ticks"] + servo["missed_ticks"] > 1000
    recording = read_recording(path)
    assert recording.truth["protection_loosened"] == [loosened]
    assert recording.t[-1] > 2.0 and recording.object_name == block.path.name


@pytest.mark.slow
def test_what_takes_long_is_said_before_and_an_object_that_is_known_is_felt_without_a_word(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    """A new object was meshed and solved for two minutes, and not a line was printed."""
    trimesh = pytest.importorskip("trimesh")
    # kernels stay where they are: what compiles has its own folder
    monkeypatch.setattr("palpate.scenes.kept.cache_folder", lambda: tmp_path / "cache")
    trimesh.creation.box((0.04, 0.04, 0.02)).apply_translation((0, 0, 0.01)).export(tmp_path / "box.stl")
    words = ["touch", str(tmp_path / "box.stl"), "--modulus", "9000", "--headless", "--seconds", "4"]
    said: list[list[str]] = []
    solved = [0.0]
    while len(said) < 2 or said[-1]:
        assert main([*words, "--json", str(tmp_path / "touch.json")]) == 0
        out, err = capsys.readouterr()
        assert not err
        lines = [line for line in out.splitlines() if line.endswith(" ...")]
        said.append(lines if not said else [line for line in lines if "compiling" not in line])
        solved.append(json.loads((tmp_path / "touch.json").read_text())["table"]["solved_share"])
        # a busy machine fills the table in several touches: what is done is kept
        assert len(solved) < 5 or solved[-1] > solved[-4] or not said[-1]
    assert len(said[0]) > 3 and len(set(said[0])) == len(said[0]) and "meshing" in said[0][0]
    assert solved == sorted(solved)
    assert not any("meshing" in line for later in said[1:] for line in later)


@pytest.mark.slow
def test_an_object_far_from_the_origin_is_felt_as_it_is_rendered(block: Model, tmp_path: Path) -> None:
    """The hand in the program works over the object, wherever its mesh lies."""
    shift = np.array([1.3, -0.4, 0.2])
    support = replace(block.support, point=block.support.point + shift)
    mesh = replace(block.mesh, points=block.mesh.points + shift)
    presses = replace(block.presses, point=block.presses.point + shift)
    moved = block.replaced(mesh=mesh, support=support, presses=presses, path=None)
    path = write_model(tmp_path / "far", moved)
    felt = pp.touch(path, headless=True, seconds=3.0, renderer="kelvin-voigt", stale_s=2.0).report
    assert felt.peak_force_n > 0.3 and "outside the workspace" not in felt.reasons


def test_a_model_that_is_in_no_folder_is_to_be_saved_before_a_window_or_a_device_touches_it(block: Model):
    with pytest.raises(pp.OptionError, match="save"):
        pp.touch(block.replaced(path=None), headless=True)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--headless", "--device", "mouse"], "drop --headless"),
        (["--headless", "--device", "glove"], "mouse, spacemouse"),
        (["--headless", "--renderer", "magic"], "allowed are fem"),
        (["--headless", "--seconds", "-1"], "greater than 0"),
        (["--headless", "--screenshot", "seen.png"], "--screenshot"),
        (["--headless", "--device", "replay"], "--replay REC"),
        (["--headless", "--device", "spacemouse"], "plug"),
    ],
)
def test_what_cannot_be_says_why(
    block: Model, words: list[str], says: str, capsys: pytest.CaptureFixture
) -> None:
    assert main(["touch", str(block.path), *words]) == 2
    error = capsys.readouterr().err.strip()
    assert says in error and "\n" not in error


def test_no_screen_is_said(
    block: Model, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    if not sys.platform.startswith("linux"):
        pytest.skip("only Linux can be without a screen")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert main(["touch", str(block.path)]) == 2
    assert "--headless" in capsys.readouterr().err


def test_a_screen_that_does_not_answer_is_said(
    block: Model, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    """Of a DISPLAY that was left over the program died in the drawing library, with exit code 139."""
    if not sys.platform.startswith("linux") or not find_library("X11"):
        pytest.skip("only of an X server can be asked whether it is there")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("DISPLAY", ":9999")
    assert main(["touch", str(block.path)]) == 2
    error = capsys.readouterr().err
    assert "DISPLAY=:9999" in error and "--headless" in error


def test_tracing_counts_the_way_around(block: Model) -> None:
    tracing = BaseTracing(block)
    angle = np.linspace(0, np.pi, 200)
    along = np.column_stack([np.cos(angle), np.sin(angle)])
    along *= 0.045 / np.abs(along).max(axis=1)[:, None]  # around the square foot, a tip's radius off it
    half = np.column_stack([along, np.full(200, 0.0048)])
    ticks = np.arange(200)
    tracing.add(half, ticks)
    assert tracing.share == pytest.approx(0.5, abs=0.03) and not tracing.done
    tracing.add(half * [-1, -1, 2], 200 + ticks)  # above the support: does not count
    assert tracing.off_m == 0
    tracing.add(half * [-1.4, -1.4, 1], 400 + ticks)  # away from the foot: does not count either
    assert tracing.off_m == pytest.approx(0.4 * 0.045, abs=1e-3), "and how far is said"
    assert tracing.share == pytest.approx(0.5, abs=0.03) and tracing.last == 199
    tracing.add(half * [-1, -1, 1], 600 + ticks)
    assert tracing.done and (tracing.first, tracing.last) == (0, 799)
    tracing.add(half, 800 + ticks)
    assert tracing.last == 799, "what comes after the way around is palpation"


@pytest.fixture
def screen() -> Iterator[str]:
    """A virtual screen; skipped where Xvfb or xdotool is missing."""
    if not (shutil.which("Xvfb") and shutil.which("xdotool")):
        pytest.skip("needs Xvfb and xdotool")
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1300x850x24"],
        pass_fds=(write,),
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    with os.fdopen(read) as pipe:
        display = f":{pipe.readline().strip()}"
    yield display
    server.terminate()
    server.wait()


@pytest.mark.slow
def test_a_person_with_only_a_mouse(block: Model, screen: str, tmp_path: Path) -> None:
    """A real window, a real pointer: hover, press, drag, keys; the recording holds what the hand did."""
    path, picture = tmp_path / "mouse.csv.gz", tmp_path / "window.png"
    environment = {**os.environ, "DISPLAY": screen}
    environment.pop("WAYLAND_DISPLAY", None)
    command = [sys.executable, "-m", "palpate.cli", "touch", str(block.path), "--beside", "hunt-crossley"]
    command += ["--record", str(path), "--screenshot", str(picture)]
    program = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)

    def pointer(*words: str) -> str:
        return subprocess.run(
            ["xdotool", *words], env=environment, capture_output=True, text=True, check=False
        ).stdout.strip()

    found: list[str] = []

    def stands() -> bool:
        """The window is the same in five looks: it is made anew while it opens."""
        time.sleep(1.0)
        found[:] = [*found[-4:], pointer("search", "--name", ".- Palpate$")]
        return len(found) == 5 and len(set(found)) == 1 and bool(found[0])

    assert eventually(stands), "no window opened"
    window = found[0].splitlines()[-1]
    pointer("mousemove", "--window", window, "530", "280")
    time.sleep(3.0)
    for _ in range(4):
        pointer("mousedown", "1")
        time.sleep(4.0)
        pointer("mouseup", "1")
        time.sleep(2.0)
    pointer("windowfocus", window)
    pointer("key", "q")
    words, _ = program.communicate(timeout=PATIENCE_S)
    assert program.returncode == 0 and "N rendered, none sent" in words
    force = np.linalg.norm(read_recording(path).force_on_tool, axis=1)
    touching = force > 0.05
    assert int((np.diff(touching.astype(int)) == 1).sum()) >= 2, "two presses were felt"
    assert picture.stat().st_size > 10_000


@pytest.mark.slow
def test_what_was_rendered_is_reconstructed(block: Model, tmp_path: Path) -> None:
    """Base traced on the support, palpations, reconstruction: the modulus that was rendered, within 5 %."""
    from palpate.reconstruction.pipeline import reconstruct

    path = tmp_path / "session.csv.gz"
    words = ["touch", str(block.path), "--headless", "--record", str(path), "--sites", "12", "--repeats", "1"]
    assert main(words) == 0
    recording = read_recording(path)
    assert recording.base_model is None, "the base was traced, so nothing stands in for it"
    model = reconstruct(recording)
    assert model.material.young_modulus_pa == pytest.approx(block.material.young_modulus_pa, rel=0.05)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--hand-mass", "0"], "--hand-mass"),
        (["--stale", "1e9"], "--stale"),
        (["--jump", "1e9"], "--jump"),
        (["--slew", "1e300"], "--slew"),
        (["--ramp", "1e-300"], "--ramp"),
        (["--silence", "1e9"], "--silence"),
        (["--support-damping=-1e6"], "--support-damping"),
        (["--support-friction=-5"], "--support-friction"),
    ],
)
def test_no_option_disarms_the_hand(
    block: Model, words: list[str], says: str, capsys: pytest.CaptureFixture
) -> None:
    assert main(["touch", str(block.path), "--headless", "--seconds", "1", *words]) == 2
    [error] = capsys.readouterr().err.strip().splitlines()
    assert says in error and "allowed are numbers" in error
