"""Compile what a first touch and the demo need on a small block, in a process beside what else is to be done.

A fresh installation has no compiled kernels on disk; compiling them takes some tens of seconds of a core.
The process leaves a mark for each stage beside the kernels: it is done once. Run as `python -m
palpate.warm_up STAGE...`; a failure costs only time.
"""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from palpate.child import end_with_parent, module_command
from palpate.mechanics.kernel_cache import choose_folder

OF_THE_DEMO = (("renderer", "replay", "tick", "spring-damper model"),)
"""Stages by process. The demo itself has work for a core until they are needed: a second process would take
that from it, and import and build a block of its own (7 of 39 s of the processor)."""
OF_A_TOUCH, OF_ITS_SERVO = (("renderer",),), ("tick", "spring-damper model")
"""The same for a touch alone, whose servo process compiles its part itself before it is told what to do."""
_SIZE_M, _TIP_RADIUS_M = 0.012, 0.005


@contextmanager
def warming_up(processes_of: Sequence[Sequence[str]] = OF_THE_DEMO) -> Iterator[Callable[[], object]]:
    """What waits for the compiling processes, which are started at once and ended with the block where they
    still run then; nothing is started where these kernels are compiled. processes_of: stages by process."""
    processes = [
        subprocess.Popen(
            module_command("palpate.warm_up", *stages),
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=dict(os.environ, OMP_NUM_THREADS="1", MKL_NUM_THREADS="1"),
        )
        for stages in processes_of
        if not is_compiled(stages)
    ]
    try:
        yield lambda: [process.wait() for process in processes]
    finally:
        for process in processes:
            if process.poll() is None:
                process.terminate()
            process.wait()
            if process.stdin is not None:
                process.stdin.close()


def block_renderer(name: str = "fem") -> Any:
    """A renderer of a block that is condensed at once."""
    from palpate import render
    from palpate.mechanics.model.material import ObjectMaterial
    from palpate.mechanics.model.model import Model, Support, Tool
    from palpate.mechanics.presses.making import of_places
    from palpate.mechanics.presses.table import FITS
    from palpate.mechanics.shape.tetmesh import box_mesh

    up = np.array([0.0, 0.0, 1.0])
    mesh = box_mesh((2, 2, 2), (_SIZE_M,) * 3)
    # held all round the middle of its top: each place that can be touched costs solves on a fine mesh
    middle = np.linalg.norm(mesh.points - _SIZE_M * up, axis=1) < 0.1 * _SIZE_M
    mesh = replace(mesh, fixed=~middle, touchable=middle).quadratic()
    block = Model(
        mesh, ObjectMaterial(20e3, 0.49), Support(np.zeros(3), up), Tool(_TIP_RADIUS_M), _SIZE_M / 2
    )
    if name != "fem":  # what a press fitted is all that such a model knows
        fits = {name: np.ones(1) for name in FITS}
        place = _SIZE_M * up[None], up[None]
        block = block.replaced(presses=of_places(*place, _TIP_RADIUS_M, depth_m=1e-3, fits=fits))
    return render.create(name, block)


def stages(renderer: Any) -> dict[str, Callable[[], object]]:
    """Work by name: the renderer's step, a replay, the servo's tick round a step, and the model that is felt
    beside it."""
    return {
        "renderer": lambda: renderer.step(renderer.start(), np.array([[0.0, 0.0, _SIZE_M]])),
        "replay": lambda: _replay(renderer),
        "tick": lambda: _tick(renderer),
        "spring-damper model": lambda: _replay(block_renderer("hunt-crossley")),
    }


def _replay(renderer: Any) -> None:
    from palpate.render.replay import replay

    height = _SIZE_M + _TIP_RADIUS_M + np.linspace(5e-3, -1e-3, 50)
    replay(renderer, np.arange(50) * 1e-3, np.outer(height, [0.0, 0.0, 1.0]))


def _tick(renderer: Any) -> None:
    """Compile the servo's loop for this renderer's kind, without its step."""
    from palpate.devices.safety import SafetyOptions, safety_parameters
    from palpate.devices.virtual_hand import SPEC
    from palpate.render.passivity import PassivityOptions, passivity_parameters
    from palpate.render.scene import scene_of
    from palpate.servo.layout import total_bytes, views
    from palpate.servo.loop import compile_loop
    from palpate.servo.tick import OUT_WIDTH, TickParameters, put_pose, take_command, tick_arrays

    damping = SPEC.max_damping_n_s_per_m
    arrays = tick_arrays(views(bytearray(total_bytes())), np.zeros((1, 3)), np.zeros(3))
    parameters = TickParameters(
        1_000_000,
        200_000,
        safety_parameters(SafetyOptions(), SPEC),
        passivity_parameters(PassivityOptions(), max_damping_n_s_per_m=damping),
    )
    compile_loop(scene_of(renderer), renderer.start(), arrays, parameters)
    put_pose(arrays, arrays.pose)
    take_command(arrays, np.zeros(OUT_WIDTH))


def mark_of(stage: str) -> Path | None:
    """The file that says that a stage is compiled; None where nothing is kept."""
    named = choose_folder() or os.environ.get("NUMBA_CACHE_DIR")  # the user's own folder
    return Path(named) / f"compiled-{stage.replace(' ', '-')}-by-{version('numba')}" if named else None


def is_compiled(names: Sequence[str]) -> bool:
    """Whether what these stages compile is on disk."""
    marks = [mark_of(name) for name in names]
    return all(mark is not None and mark.is_file() for mark in marks)


def warm_up(names: Sequence[str]) -> None:
    """Compile these stages, and leave a mark for each; in a process of their own, which then collects no
    garbage: looking for it in all that numba keeps is a tenth of the work."""
    gc.disable()
    work = stages(block_renderer())
    for name in names:
        work[name]()
        mark = mark_of(name)
        if mark is not None:
            mark.touch()


if __name__ == "__main__":
    end_with_parent()
    warm_up(sys.argv[1:])
    os._exit(0)  # tidying up what numba holds takes as long as a kernel
