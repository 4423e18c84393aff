"""Kernels are compiled once, beside what else is to be done, and the demo says what can be done meanwhile."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numba
import numpy as np
import pytest
from numba.core import event

from palpate import cli, demo, warm_up
from palpate.diagnosis.forward import kernel
from palpate.mechanics.compliance.sites import touch_solver
from palpate.mechanics.effects.laws_along_path import LAWS
from palpate.mechanics.errors import ContactError
from palpate.mechanics.shape.tetmesh import box_mesh
from palpate.operations.demo import MEANWHILE


class Started:
    """A process that only remembers which stages it was to compile."""

    all: list[tuple[str, ...]] = []
    stdin = None

    def __init__(self, command: list[str], **_: object) -> None:
        Started.all.append(tuple(command[command.index("palpate.warm_up") + 1 :]))

    def wait(self) -> int:
        return 0

    def poll(self) -> int:
        return 0


def test_stages_that_are_compiled_are_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warm_up, "choose_folder", lambda: tmp_path)
    monkeypatch.setattr(warm_up.subprocess, "Popen", Started)
    monkeypatch.setattr(Started, "all", [])
    first, second = ("renderer", "replay"), ("tick", "spring-damper model")
    for left in ((), first, second):
        for name in left:
            mark = warm_up.mark_of(name)
            assert mark is not None
            mark.touch()
        with warm_up.warming_up((first, second)) as compiling:
            compiling()
    assert Started.all == [first, second, second]


def test_the_demo_leaves_a_core_to_its_own_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two processes compiled beside it on two cores, each with an import and a block of its own."""
    monkeypatch.setattr(warm_up, "choose_folder", lambda: tmp_path)
    monkeypatch.setattr(warm_up.subprocess, "Popen", Started)
    monkeypatch.setattr(Started, "all", [])
    with warm_up.warming_up() as compiling:
        compiling()
    (stages,) = Started.all
    assert set(stages) == set(warm_up.stages(None))


def test_what_is_compiled_on_is_pressed_and_has_few_places() -> None:
    """Each place costs solves on a fine mesh: with 1,313 a process computed for longer than it compiled."""
    block = warm_up.block_renderer()
    state = block.start()
    for depth in (-1e-3, 1e-3):
        tip = np.array([[0.0, 0.0, warm_up._SIZE_M + warm_up._TIP_RADIUS_M - depth]])
        force = block.step(state, tip)[1]
    assert force[0, 2] > 0.01
    assert len(block.compliance.own) < 300


def test_the_laws_along_a_path_compile_no_words() -> None:
    """An array that is set to another can be of the wrong shape, which numba would say: half of its work."""
    compiled: list[str] = []

    class Listener(event.Listener):
        def on_start(self, event: Any) -> None:
            compiled.append(event.data["dispatcher"].py_func.__module__)

        def on_end(self, event: Any) -> None:
            pass

    n, f = 4, np.zeros((4, 3))
    start, site, felt = np.array([0, n]), np.zeros(1, dtype=np.int64), np.zeros(1)
    laws = np.zeros((len(LAWS), 4)), 0.0, 1, np.zeros((len(LAWS), 8))
    with event.install_listener("numba:compile", Listener()):
        fresh = numba.njit(error_model="numpy")(kernel.follow.py_func)
        fresh(start, np.arange(4.0), np.linspace(0, 1e-3, n), site, felt, *laws, f)
    assert compiled and "numba.cpython.unicode" not in compiled


def test_the_demo_says_that_its_object_can_be_touched_meanwhile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def ends(*_: object) -> None:
        raise ContactError("that is all")

    monkeypatch.setattr("palpate.operations.demo.run_demo", ends)
    for terminal in (True, False):
        monkeypatch.setattr(sys.stderr, "isatty", lambda there=terminal: there)
        assert cli.main(["demo", "-o", str(tmp_path / "demo")]) == 2
        assert (MEANWHILE in capsys.readouterr().err) == terminal


def test_the_demo_factorises_its_object_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Reconstruction, compliance and diagnosis are of one mesh: each factorised it anew."""
    mesh = box_mesh((2, 2, 2), (0.02,) * 3)
    used: list[object] = []
    model = SimpleNamespace(model=None)

    def solves(*_: object, **__: object) -> SimpleNamespace:
        used.append(touch_solver(mesh, 0.45))
        return model

    for name in ("reconstruct", "renderer", "diagnose"):
        monkeypatch.setattr(demo, name, solves)
    monkeypatch.setattr(demo, "warming_up", lambda: nullcontext(lambda: None))
    monkeypatch.setattr(demo, "read_recording", lambda *_: None)
    monkeypatch.setattr(
        demo, "replay", lambda *_, **__: SimpleNamespace(force_n=None, rmse_n=0.0, force_rms_n=1.0)
    )
    monkeypatch.setattr(demo, "run_headless", lambda *_, **__: None)
    demo.run_demo("REC", tmp_path, demo.DemoOptions())
    assert len(used) == 3
    assert all(each is used[0] for each in used)


def test_the_demo_waits_for_kernels_only_where_it_feels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It stood still before the diagnosis, which needs none of them, while another core compiled."""
    done: list[str] = []

    def does(name: str, result: object = None) -> None:
        monkeypatch.setattr(demo, name, lambda *_, **__: done.append(name) or result)

    @contextmanager
    def warming_up() -> Iterator[Callable[[], object]]:
        yield lambda: done.append("compiled")

    monkeypatch.setattr(demo, "warming_up", warming_up)
    replayed = SimpleNamespace(force_n=None, rmse_n=0.0, force_rms_n=1.0)
    for name, result in {
        "read_recording": None,
        "reconstruct": SimpleNamespace(model=None),
        "renderer": None,
        "diagnose": None,
        "replay": replayed,
        "run_headless": None,
    }.items():
        does(name, result)
    result = demo.run_demo("REC", tmp_path, demo.DemoOptions())
    assert done[1:] == ["reconstruct", "renderer", "diagnose", "compiled", "replay", "run_headless"]
    assert set(result.seconds) == {"reconstruct", "precompute", "diagnose", "replay", "feel at 1 kHz"}
