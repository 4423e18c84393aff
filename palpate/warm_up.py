"""Compile what the demo needs on a small block, in a process beside the reconstruction.

A fresh installation has no compiled kernels on disk; compiling them takes some tens of seconds of one core,
which the second core can do while the first reconstructs. It leaves a mark beside the kernels, so that it is
done once. Run as `python -m palpate.warm_up`; a failure costs only time.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.kernel_cache import choose_folder
from palpate.child import end_with_parent, module_command, module_environment


@contextmanager
def warming_up() -> Iterator[Callable[[], object]]:
    """What waits for the compiling process, which is started at once and ended with the block where it still
    runs then; nothing is started where these kernels are compiled."""
    mark = _mark()
    if mark is not None and mark.is_file():
        yield lambda: None
        return
    process = subprocess.Popen(
        module_command("palpate.warm_up"),
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=module_environment(OMP_NUM_THREADS="1", MKL_NUM_THREADS="1"),
    )
    try:
        yield process.wait
    finally:
        if process.poll() is None:
            process.terminate()
        process.wait()
        if process.stdin is not None:
            process.stdin.close()


@contextmanager
def block_renderer() -> Iterator[Any]:
    """The finite-element renderer of a block of 40 mm, whose folder goes with the context."""
    import render
    from mechanics.box_mesh import box_mesh
    from mechanics.material import Material
    from mechanics.model import Model, Support, Tool
    from mechanics.model_files import write_model

    mesh = box_mesh((3, 3, 3), (0.04, 0.04, 0.04)).quadratic()
    up = np.array([0.0, 0.0, 1.0])
    with tempfile.TemporaryDirectory() as folder:
        block = Model(mesh, Material(20e3, 0.49), Support(np.zeros(3), up), Tool(0.005), 0.0133)
        block = block.replaced(path=write_model(Path(folder) / "block", block))
        yield render.create("fem", block)


def stages(renderer: Any) -> tuple[tuple[str, Callable[[], object]], ...]:
    """(name, work) in order: a replay on the block, and the servo's tick."""
    return ("renderer", lambda: _replay(renderer)), ("tick", lambda: _tick(renderer))


def _replay(renderer: Any) -> None:
    from render.replay import replay

    path = np.outer(np.linspace(0.05, 0.043, 50), np.array([0.0, 0.0, 1.0]))
    replay(renderer, np.arange(50) * 1e-3, path)


def _tick(renderer: Any) -> None:
    """Make the servo's loop ready for this renderer."""
    from devices.safety import SafetyOptions, safety_parameters
    from devices.simulated import SPEC
    from palpate.servo.layout import total_bytes, views
    from palpate.servo.loop import make_program
    from palpate.servo.tick import TickParameters, put_pose, tick_arrays
    from render.passivity import PassivityOptions, passivity_parameters
    from render.scene import scene_of

    damping = SPEC.max_damping_n_s_per_m
    arrays = tick_arrays(views(bytearray(total_bytes())), np.zeros((1, 3)), np.zeros(3))
    parameters = TickParameters(
        1_000_000,
        200_000,
        safety_parameters(SafetyOptions(), SPEC),
        passivity_parameters(PassivityOptions(), max_damping_n_s_per_m=damping),
    )
    make_program(scene_of(renderer), arrays, parameters)
    put_pose(arrays, arrays.pose)


def warm_up() -> None:
    """Compile it all, and leave the mark."""
    with block_renderer() as renderer:
        for _, work in stages(renderer):
            work()
    mark = _mark()
    if mark is not None:
        mark.touch()


def _mark() -> Path | None:
    folder = choose_folder()
    return None if folder is None else folder / f"compiled-for-the-demo-by-{version('numba')}"


if __name__ == "__main__":
    end_with_parent()
    warm_up()
