"""The loop round the tick: absolute deadlines, no interpreter in between.

`ServoLoop` runs in a thread of the servo process. On Linux the whole loop is one compiled call that holds no
interpreter lock, returning only to stop or to swap the renderer; elsewhere Python sleeps and calls the tick.
"""

from __future__ import annotations

import os
import threading
import time
from typing import Any, NamedTuple

import numpy as np
from numba import njit, typeof, types

from palpate.mechanics.kernels import kept, loop_kernel, pointer, step_type
from palpate.render.scene import TouchScene
from palpate.servo.clock import COMPILED, c_function, compiled_now_ns, compiled_sleep_until, sleep_until
from palpate.servo.layout import DEADLINE, STATUS, STOP, UNSETTLED
from palpate.servo.tick import TickArrays, TickParameters, account, after, before

_write = c_function("write", types.intp(types.int32, types.voidptr, types.uintp))

SWAP = 7
"""Cell of `control` by which this process's own threads ask the loop to come back."""


@njit(inline="always", nogil=True)
def one_tick(kernel, model, state, support, arrays, parameters, now_ns, deadline_ns):
    """A whole tick with the renderer's kernel in its middle, and the support beside it."""
    before(arrays)
    answer(kernel, model, state, support, arrays, parameters, now_ns, deadline_ns)


@njit(inline="always", nogil=True)
def answer(kernel, model, state, support, arrays, parameters, now_ns, deadline_ns):
    """The tick once its pose is taken; now_ns: not before that."""
    unsettled = state.unsettled[0]
    kernel(model, state, arrays.tips)
    arrays.shared.counts[UNSETTLED] += state.unsettled[0] - unsettled
    after(
        arrays,
        parameters,
        support,
        state.forces,
        state.points,
        state.normals,
        state.depths,
        state.touching,
        state.stiffness,
        state.radii_m,
        now_ns,
        deadline_ns,
    )


@loop_kernel
def compiled_loop(kernel, model, state, support, arrays, parameters, wake, most_ticks):
    """Tick until told to stop or swap; `wake` is a file descriptor told after each tick, -1 for none."""
    for _ in range(most_ticks):
        if arrays.shared.control[STOP] != 0 or arrays.shared.control[SWAP] != 0:
            return
        deadline = arrays.shared.counts[DEADLINE]
        compiled_sleep_until(arrays.timespec, deadline)
        started = compiled_now_ns(arrays.timespec)
        before(arrays)
        # a stall in between makes the pose younger than the tick, and no clock run backwards
        read = compiled_now_ns(arrays.timespec)
        answer(kernel, model, state, support, arrays, parameters, read, deadline)
        ended = compiled_now_ns(arrays.timespec)
        account(arrays, parameters, deadline, started, ended)
        if wake >= 0:
            _write(wake, arrays.word.ctypes, 8)


class Program(NamedTuple):
    """A scene made ready: its renderer's kernel as a pointer, the loop compiled for it, and its state."""

    scene: TouchScene
    kernel: Any
    loop: Any
    state: Any
    parameters: TickParameters


def make_program(scene: TouchScene, arrays: TickArrays, parameters: TickParameters) -> Program:
    """Compile the loop for this scene and touch its memory; nothing of a running loop is changed."""
    renderer = scene.renderer
    radii = np.full(len(arrays.offsets), float(renderer.start().radii_m[0]))
    state = renderer.start(radii_m=radii, dt_s=parameters.period_ns * 1e-9)
    warm_up(renderer, state)
    state = renderer.start(radii_m=radii, dt_s=parameters.period_ns * 1e-9)
    kernel = pointer(renderer.kernel, renderer.parameters, state, arrays.tips)
    loop = None
    if COMPILED:
        loop = kept(compiled_loop, renderer.parameters)
        loop(kernel, renderer.parameters, state, scene.support, arrays, parameters, -1, 0)
    return Program(scene, kernel, loop, state, parameters)


def compile_loop(scene: TouchScene, state: Any, arrays: TickArrays, parameters: TickParameters) -> None:
    """Compile the loop for a scene of this kind, which asks for the type of its step alone, not for the step:
    another process may compile that meanwhile."""
    renderer = scene.renderer
    if not COMPILED:
        return
    step = step_type(renderer.parameters, state, arrays.tips)
    given = (renderer.parameters, state, scene.support, arrays, parameters, -1, 0)
    kept(compiled_loop, renderer.parameters).compile((step, *map(typeof, given)))


def warm_up(renderer: Any, state: Any, places: int = 100) -> None:
    """Press at places all over the surface, so that code is compiled and pages are in memory."""
    tips = np.full((len(state.forces), 3), np.nan)
    renderer.kernel(renderer.parameters, state, tips)
    points, _ = renderer.surface
    if not len(points):
        return
    centre = points.mean(axis=0)
    for k in np.linspace(0, len(points) - 1, places).astype(int):
        for depth in (1.2, 1.0, 0.98):
            tips[:] = centre + depth * (points[k] - centre)
            renderer.kernel(renderer.parameters, state, tips)


class ServoLoop:
    """The loop's thread and what it runs, `program`. `ticked` is set after each tick where the loop runs in
    Python; wake_descriptor: readable after each tick (Linux), else -1."""

    def __init__(self, program: Program, arrays: TickArrays, *, on_start: Any = None) -> None:
        self.arrays = arrays
        self.program = program
        self._pending: Program | None = None
        self._swapped = threading.Event()
        self._on_start = on_start
        self.ticked = threading.Event()
        self.wake_descriptor = os.eventfd(0, os.EFD_NONBLOCK) if COMPILED else -1
        self._thread = threading.Thread(target=self._run, name="servo loop", daemon=True)

    def start(self, first_deadline_ns: int | None = None) -> None:
        """Begin ticking, a period from now."""
        period = self.program.parameters.period_ns
        self.arrays.shared.counts[DEADLINE] = first_deadline_ns or time.perf_counter_ns() + 2 * period
        self.arrays.shared.counts[STATUS] = 1
        self._thread.start()

    def swap(self, program: Program, timeout_s: float = 1.0) -> bool:
        """Go on with another program between two ticks; False where the loop did not answer."""
        self._swapped.clear()
        self._pending = program
        self.arrays.shared.control[SWAP] = 1
        return self._swapped.wait(timeout_s)

    def join(self, timeout_s: float | None = None) -> bool:
        """Wait for the end; True once the loop has ended."""
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            if self._on_start is not None:
                self._on_start()
            while self.arrays.shared.control[STOP] == 0:
                if self._pending is not None:
                    self.program, self._pending = self._pending, None
                    self.arrays.shared.control[SWAP] = 0
                    self._swapped.set()
                if COMPILED:
                    scene, kernel, loop, state, parameters = self.program
                    loop(
                        kernel,
                        scene.renderer.parameters,
                        state,
                        scene.support,
                        self.arrays,
                        parameters,
                        self.wake_descriptor,
                        np.iinfo(np.int64).max,
                    )
                else:
                    portable_tick(self.program, self.arrays)
                    self.ticked.set()
        finally:
            self.arrays.shared.counts[STATUS] = 0


def portable_tick(program: Program, arrays: TickArrays) -> None:
    """One tick driven from Python, for platforms whose sleep the compiled loop cannot call."""
    deadline = int(arrays.shared.counts[DEADLINE])
    sleep_until(deadline)
    started = time.perf_counter_ns()
    run_tick(program, arrays, started, deadline)
    account(arrays, program.parameters, deadline, started, time.perf_counter_ns())


def run_tick(program: Program, arrays: TickArrays, now_ns: int, deadline_ns: int) -> None:
    """One tick at a time that is handed in: what the compiled loop does between two deadlines."""
    renderer, support = program.scene.renderer, program.scene.support
    state, parameters = program.state, program.parameters
    before(arrays)
    answer.py_func(
        renderer.kernel, renderer.parameters, state, support, arrays, parameters, now_ns, deadline_ns
    )
