"""What the servo's benchmark runs: a block, tips that slide over it, and the loop that times them."""

from __future__ import annotations

import threading
import time
from typing import Any, NamedTuple

import numpy as np
from numba import njit, types

from benchmarks._closed_loop import enabled_pose
from benchmarks.compliance import block
from palpate.devices.safety import SafetyOptions, safety_parameters
from palpate.devices.virtual_hand import SPEC
from palpate.mechanics.disk.scratch import cache_folder
from palpate.mechanics.kernels import kept
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.render.passivity import PassivityOptions, passivity_parameters
from palpate.render.scene import in_the_air
from palpate.servo.clock import c_function, compiled_now_ns, compiled_sleep_until, real_time_thread
from palpate.servo.histogram import BINS, Histogram, count
from palpate.servo.layout import (
    DEADLINE,
    ENABLE,
    LATE,
    MISSED,
    SharedArrays,
    total_bytes,
    views,
    write_block,
)
from palpate.servo.loop import Program, make_program, one_tick
from palpate.servo.tick import (
    IN_POSITION,
    IN_SEQUENCE,
    IN_TIME,
    IN_TIP,
    TickArrays,
    TickParameters,
    account,
    tick_arrays,
)

PERIOD_NS = 1_000_000
LATE_NS = 200_000
SPACING_M = 0.011
TIP_RADIUS_M = 0.005
DEPTH_M = 0.002
SLIDE_M = 0.004
FRICTION = 0.5
THREAD_CPU = 3
_gettime = c_function("clock_gettime", types.int32(types.int32, types.voidptr))


@njit(cache=True, nogil=True)
def thread_cpu_ns(timespec):
    """CPU time of the calling thread in ns; timespec: (2,) int64 scratch."""
    _gettime(THREAD_CPU, timespec.ctypes)
    return timespec[0] * 1_000_000_000 + timespec[1]


def block_model(touchable: int) -> Model:
    """A silicone block of quadratic tetrahedra with about that many touchable nodes."""
    mesh = block(touchable)
    low = mesh.points.min(axis=0)
    return Model(
        mesh=mesh,
        material=ObjectMaterial(30e3, 0.49),
        support=Support(low, np.array([0.0, 0.0, 1.0])),
        tool=Tool(TIP_RADIUS_M),
        mesh_size_m=float(np.cbrt(mesh.volumes.mean() * 8.5)),
    )


def tip_offsets(tips: int) -> np.ndarray:
    """(tips, 3) m: a grid as square as can be, 11 mm apart, at one height."""
    columns = int(np.ceil(np.sqrt(tips)))
    k = np.arange(tips)
    grid = np.stack([k % columns, k // columns, np.zeros(tips)], axis=1) * SPACING_M
    return grid - grid.mean(axis=0)


def sliding_path(model: Model, ticks: int) -> np.ndarray:
    """(ticks, 3) m, the tool's centre: circles of 4 mm, all tips 2 mm deep in the top, 20 ms in free air a
    second, so that contact is made and lost as well."""
    high = model.mesh.points.max(axis=0)
    centre = 0.5 * (high + model.mesh.points.min(axis=0))
    t = np.arange(ticks) * PERIOD_NS * 1e-9
    depth = np.where(t % 1.0 < 0.02, -0.001, DEPTH_M + 0.0005 * np.sin(2 * np.pi * 3.0 * t))
    path = np.stack(
        [
            centre[0] + SLIDE_M * np.cos(2 * np.pi * t),
            centre[1] + SLIDE_M * np.sin(2 * np.pi * t),
            high[2] + TIP_RADIUS_M - depth,
        ],
        axis=1,
    )
    return np.ascontiguousarray(path)


@njit(cache=True, nogil=True)
def _timed(
    kernel, model, state, support, arrays, parameters, path, ticks, start, wait, cpu_bins, cpu_extremes
):
    """The servo's loop, its poses taken from `path`; wait: sleep to each deadline, else free-running."""
    pose = enabled_pose()
    for tick in range(ticks):
        for i in range(3):
            pose[IN_POSITION + i] = path[(start + tick) % path.shape[0], i]
            pose[IN_TIP + i] = pose[IN_POSITION + i]
        pose[IN_SEQUENCE] = start + tick
        deadline = arrays.shared.counts[DEADLINE]
        pose[IN_TIME] = deadline * 1e-9
        write_block(arrays.inbox_version, arrays.inbox, pose)
        if wait:
            compiled_sleep_until(arrays.timespec, deadline)
        began = compiled_now_ns(arrays.timespec)
        cpu = thread_cpu_ns(arrays.timespec)
        one_tick(kernel, model, state, support, arrays, parameters, max(began, deadline), deadline)
        count(cpu_bins, cpu_extremes, thread_cpu_ns(arrays.timespec) - cpu)
        ended = compiled_now_ns(arrays.timespec)
        account(arrays, parameters, deadline, began, ended)
        if not wait:
            arrays.shared.counts[DEADLINE] = ended


class Measured(NamedTuple):
    """compute (wall), cpu, lateness: histograms; late, missed: ticks; cpu_s, wall_s of the runs."""

    compute: Histogram
    cpu: Histogram
    lateness: Histogram
    ticks: int
    late: int
    missed: int
    cpu_s: float
    wall_s: float


def renderer_of(touchable: int) -> tuple[Any, np.ndarray]:
    """The FEM renderer of a block, its compliance kept in the cache folder; and the tool's path."""
    from palpate import render
    from palpate.render.options import RenderOptions

    folder = cache_folder() / f"servo-benchmark-{touchable}"
    if not (folder / "model.toml").exists():
        write_model(folder, block_model(touchable))
    model = read_model(folder)
    return render.create("fem", model, options=RenderOptions(friction=FRICTION)), sliding_path(model, 20_000)


class Load:
    """A renderer with its tips under way, run in slices."""

    def __init__(self, renderer: Any, path: np.ndarray, tips: int) -> None:
        self.shared: SharedArrays = views(bytearray(total_bytes()))
        self.arrays: TickArrays = tick_arrays(self.shared, tip_offsets(tips), path.mean(axis=0))
        parameters = TickParameters(
            PERIOD_NS,
            LATE_NS,
            safety_parameters(SafetyOptions(), SPEC),
            passivity_parameters(
                PassivityOptions(), max_damping_n_s_per_m=SPEC.max_damping_n_s_per_m, delay_ticks=0.4
            ),
        )
        self.program: Program = make_program(in_the_air(renderer), self.arrays, parameters)
        self.arrays.shared.control[ENABLE] = 1
        self._path = path
        self._done = 0
        self._cpu_s = self._wall_s = 0.0
        self._cpu_bins, self._cpu_extremes = np.zeros(BINS, dtype=np.int64), np.zeros(3, dtype=np.int64)
        self._call(0, False)

    def _call(self, ticks: int, wait: bool) -> None:
        scene, kernel, _, state, parameters = self.program
        kept(_timed, scene.renderer.parameters)(
            kernel,
            scene.renderer.parameters,
            state,
            scene.support,
            self.arrays,
            parameters,
            self._path,
            ticks,
            self._done,
            wait,
            self._cpu_bins,
            self._cpu_extremes,
        )

    def run_in_real_time(self, ticks: int) -> str:
        """More ticks at their deadlines, in a real-time thread where that is permitted; returns why not."""
        words: list[str] = []

        def work() -> None:
            words.append(real_time_thread(60))
            self.run(ticks, wait=True)

        thread = threading.Thread(target=work)
        thread.start()
        thread.join()
        return words[0]

    def run(self, ticks: int, *, wait: bool) -> None:
        """More ticks, in the thread that calls."""
        self.arrays.shared.counts[DEADLINE] = time.perf_counter_ns() + 2 * PERIOD_NS
        wall, cpu = time.perf_counter(), time.thread_time()
        self._call(ticks, wait)
        self._wall_s += time.perf_counter() - wall
        self._cpu_s += time.thread_time() - cpu
        self._done += ticks

    def measured(self) -> Measured:
        """Of all slices."""
        a = self.shared
        return Measured(
            Histogram(a.compute_bins.copy(), int(a.compute_extremes[1]), int(a.compute_extremes[2])),
            Histogram(self._cpu_bins.copy(), int(self._cpu_extremes[1]), int(self._cpu_extremes[2])),
            Histogram(a.lateness_bins.copy(), int(a.lateness_extremes[1]), int(a.lateness_extremes[2])),
            self._done,
            int(a.counts[LATE]),
            int(a.counts[MISSED]),
            self._cpu_s,
            self._wall_s,
        )
