"""A long session: the servo against the simulated hand, beside a window that draws and a recording.

Memory, threads and open files of both processes over the time, the clock's drift, late ticks; then the model
swapped again and again while the hand touches. Slopes are Theil and Sen's with their 95 % intervals, over the
samples after the first tenth.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from scipy.stats import theilslopes

from benchmarks._servo_load import block_model
from benchmarks.timing import table
from palpate.devices.safety import LATCHING, SILENT, WORDS
from palpate.mechanics.disk.scratch import cache_folder
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import read_recording
from palpate.servo import Servo, exploring_hand
from palpate.servo.layout import DEADLINE, LATE, MISSED, STARTED, TICKS
from palpate.servo.source import ModelSource
from palpate.window.session import TouchSession

SAMPLES = 120
LATCHED = tuple(word for bit, word in WORDS.items() if bit & LATCHING)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Lengths and loads."""
    parser.add_argument("--minutes", type=float, default=30.0, help="of the session")
    parser.add_argument("--frames-per-s", type=float, default=20.0, help="pictures that the window draws")
    parser.add_argument("--swaps", type=int, default=1000, help="of the model, while touching")
    parser.add_argument("--nodes", type=int, default=500, help="touchable nodes of the model, about")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure, print, return."""
    models = [_model(arguments.nodes, scale) for scale in (1.0, 2.0)]
    result: dict[str, Any] = {"minutes": arguments.minutes, "frames_per_s": arguments.frames_per_s}
    if arguments.minutes > 0:
        result["session"] = _session(models[0], arguments.minutes * 60.0, arguments.frames_per_s)
        _print_session(result["session"])
    if arguments.swaps > 0:
        result["swaps"] = _swaps(models, arguments.swaps)
        print(table(list(result["swaps"]), [list(result["swaps"].values())]))
    return result


def _model(nodes: int, scale: float) -> Model:
    """A block, its modulus times `scale`, kept with its compliance in the cache folder."""
    folder = cache_folder() / f"soak-benchmark-{nodes}-{scale:g}"
    if not (folder / "model.toml").exists():
        made = block_model(nodes)
        write_model(folder, made.with_modulus(scale * made.material.young_modulus_pa))
    return read_model(folder)


class Health:
    """Samples of both processes over a session."""

    def __init__(self, servo: Servo) -> None:
        self._servo = servo
        self._pids = {"window": os.getpid(), "servo": servo.process_id}
        self._start_s = time.perf_counter()
        self.rows: list[dict[str, float]] = []

    def sample(self) -> None:
        """One row, now."""
        counts = self._servo.arrays.counts
        # how far the next deadline lies ahead of the clock that the deadlines are set on
        ahead_s = int(counts[DEADLINE]) * 1e-9 - time.perf_counter()
        period_s = self._servo.options.period_ns * 1e-9
        ran_s = (int(counts[TICKS]) + int(counts[MISSED])) * period_s
        row = {
            "t_s": time.perf_counter() - self._start_s,
            "utc_s": time.time() - time.perf_counter(),
            "ahead_s": ahead_s,
            "phase_s": ran_s - (int(counts[DEADLINE]) - int(counts[STARTED])) * 1e-9,
            "ticks": float(counts[TICKS]),
            "late": float(counts[LATE]),
            "missed": float(counts[MISSED]),
            "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan"),
        }
        for name, pid in self._pids.items():
            row |= {f"{name}_{key}": value for key, value in process_size(pid).items()}
        self.rows.append(row)

    def column(self, name: str) -> np.ndarray:
        """Of all samples."""
        return np.array([row[name] for row in self.rows])

    def slope(self, name: str) -> dict[str, float]:
        """A minute, with its 95 % interval, after the first tenth."""
        first = len(self.rows) // 10
        t, y = self.column("t_s")[first:] / 60.0, self.column(name)[first:]
        slope, _, low, high = theilslopes(y, t, 0.95)
        return {"a_minute": float(slope), "low": float(low), "high": float(high)}


def process_size(pid: int) -> dict[str, float]:
    """rss_mb, threads and files of a process."""
    process = psutil.Process(pid)
    return {
        "rss_mb": process.memory_info().rss / 2**20,
        "threads": float(process.num_threads()),
        "files": float(process.num_fds()),
    }


class Picture:
    """The surface as it is felt, drawn off screen."""

    def __init__(self, model: Model, points: np.ndarray, triangles: np.ndarray) -> None:
        import pyvista as pv

        self._rest = points
        faces = np.column_stack([np.full(len(triangles), 3), triangles])
        self._mesh = pv.PolyData(points.copy(), faces.ravel())
        self._plotter = pv.Plotter(off_screen=True, window_size=[640, 480])
        self._plotter.add_mesh(self._mesh)
        self._actor = self._plotter.add_mesh(pv.Sphere(radius=model.tool.tip_radius_m))
        self._plotter.show(auto_close=False)

    def draw(self, displacement: np.ndarray, tip_m: np.ndarray) -> None:
        """One picture."""
        if displacement.shape == self._rest.shape:
            self._mesh.points = self._rest + displacement
        if np.isfinite(tip_m).all():
            self._actor.position = tuple(tip_m)
        self._plotter.render()

    def close(self) -> None:
        """Release it."""
        self._plotter.close()


def _session(model: Model, seconds: float, frames_per_s: float) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        record = Path(folder) / "soak.csv"
        session = TouchSession(model, device=exploring_hand(model))
        with session:
            session.start()
            picture = Picture(model, *session.drawing(session.renderer_name).surface)
            session.begin_recording(record)
            session.enable()
            health, frames, enablings, next_sample = Health(session.servo), 0, 1, 0.0
            start = time.perf_counter()
            while (elapsed := time.perf_counter() - start) < seconds and session.servo.alive:
                frame = session.frame()
                if frame is not None:
                    picture.draw(frame.views[0].displacement_m, frame.tip_m)
                    frames += 1
                    if any(word in frame.reason for word in LATCHED):
                        # as a person does, who wants to go on
                        session.enable()
                        enablings += 1
                if elapsed >= next_sample:
                    health.sample()
                    next_sample += seconds / SAMPLES
                time.sleep(max(0.0, start + frames / frames_per_s - time.perf_counter()))
            health.sample()
            report = session.report()
            picture.close()
        recorded = read_recording(record)
    spacing = np.diff(recorded.t) * session.servo.options.rate_hz
    kept = {
        "enablings": enablings,
        "rows": len(recorded.t),
        "missing rows": int(np.round(spacing - 1.0).clip(0).sum()),
    }
    return _summary(health, report.as_dict(), frames, kept)


def _summary(health: Health, report: dict[str, Any], frames: int, recorded: dict[str, int]) -> dict[str, Any]:
    ahead, phase, utc = (health.column(name) for name in ("ahead_s", "phase_s", "utc_s"))
    last = len(health.rows) - 1
    at = {"start": last // 10, "middle": last // 2, "end": last}
    half = last // 2
    late = health.column("late")
    return {
        "report": report,
        "frames": frames,
        "recorded": recorded,
        "stages": {stage: {k: v for k, v in health.rows[i].items() if "_" in k} for stage, i in at.items()},
        "slopes": {
            name: health.slope(name)
            for name in ("window_rss_mb", "servo_rss_mb", "window_files", "servo_files", "servo_threads")
        },
        "load": [float(v) for v in np.percentile(health.column("load"), [0, 50, 100])],
        "deadline_ahead_ms": [float(1e3 * v) for v in np.percentile(ahead, [0, 50, 100])],
        "ahead_first_ms": float(1e3 * np.median(ahead[:half])),
        "ahead_second_ms": float(1e3 * np.median(ahead[half:])),
        "phase_drift_us": float(1e6 * (phase[-1] - phase[0])),
        "utc_drift_ms": float(1e3 * (utc[-1] - utc[0])),
        "late_first_half": float(late[half] - late[0]),
        "late_second_half": float(late[-1] - late[half]),
    }


def _print_session(seen: dict[str, Any]) -> None:
    rows = []
    for name, slope in seen["slopes"].items():
        stages = [seen["stages"][s][name] for s in ("start", "middle", "end")]
        rows.append([name.replace("_", " "), *stages, slope["a_minute"], slope["low"], slope["high"]])
    print(table(["", "start", "middle", "end", "slope a minute", "95 % from", "to"], rows))
    report = seen["report"]
    print(
        f"{report['ticks']} ticks, {report['missed_ticks']} missed, {report['late_ticks']} late "
        f"({seen['late_first_half']:.0f} in the first half, {seen['late_second_half']:.0f} in the second), "
        f"{seen['frames']} pictures, {seen['recorded']['rows']} rows recorded, "
        f"{seen['recorded']['missing rows']} missing, enabled {seen['recorded']['enablings']} times; "
        f"ticks against deadlines {seen['phase_drift_us']:.3f} us, the next deadline a median of "
        f"{seen['ahead_first_ms']:.2f} ms ahead in the first half, {seen['ahead_second_ms']:.2f} in the "
        f"second; the system's wall clock went {seen['utc_drift_ms']:.2f} ms against the loop's"
    )
    low, usual, high = seen["load"]
    latched = {word: n for word, n in report["reasons"].items() if word in LATCHED}
    print(
        f"energy given back at most {1e3 * report['energy_given_back_j']:.3f} mJ, damped "
        f"{1e3 * report['energy_damped_j']:.1f} mJ, greatest force {report['peak_force_n']:.2f} N, in "
        f"contact {100 * report['contact_share']:.0f} %, ticks with a latched fault: {latched or 'none'}, "
        f"zeroed for silence {report['reasons'].get(WORDS[SILENT], 0)}; load {low:.1f} to {high:.1f}, "
        f"median {usual:.1f}"
    )


def _swaps(models: list[Model], swaps: int) -> dict[str, Any]:
    """Swap between the models while the hand explores; every tick's force against clamp and slew."""
    with Servo(models[0], device=exploring_hand(models[0])) as servo:
        servo.start()
        servo.enable()
        servo.wait(2.0)
        health, continuity = Health(servo), Continuity(servo)
        continuity.look()
        started = time.perf_counter()
        for k in range(swaps):
            path = models[(k + 1) % len(models)].path
            assert path is not None
            servo.set_source(ModelSource(path))
            continuity.look()
            if k % max(1, swaps // SAMPLES) == 0:
                health.sample()
        seconds = time.perf_counter() - started
        health.sample()
        report = servo.report()
    growth = health.column("servo_rss_mb")
    return {
        "swaps": swaps,
        "s each": seconds / swaps,
        "ticks looked at": continuity.ticks,
        "ticks with force": continuity.forced,
        "greatest N": continuity.greatest_n,
        "clamp N": continuity.clamp_n,
        "greatest rise / slew": continuity.greatest_rise,
        "missed": report.missed_ticks,
        "servo RSS start MB": float(growth[len(growth) // 10]),
        "end MB": float(growth[-1]),
        "files start": float(health.rows[0]["servo_files"]),
        "files end": float(health.rows[-1]["servo_files"]),
    }


class Continuity:
    """Commands tick by tick: how large, and how fast they rise or turn against what the slew limit allows."""

    def __init__(self, servo: Servo) -> None:
        from palpate.devices.virtual_hand import SPEC

        self.clamp_n = SPEC.max_force_n
        self.ticks = self.forced = 0
        self.greatest_n = self.greatest_rise = 0.0
        self._servo, self._next = servo, int(servo.arrays.ring_head[0])
        self._last: np.ndarray | None = None

    def look(self) -> None:
        """At all ticks since the last look."""
        rows, self._next = self._servo.history(self._next)
        if self._last is not None:
            rows = np.concatenate([self._last, rows])
        if len(rows) < 2:
            return
        self._last = rows[-1:]
        force, period_s = rows["command"], self._servo.options.period_ns * 1e-9
        before, after = force[:-1], force[1:]
        length2 = np.maximum((before**2).sum(axis=1), 1e-300)
        share = np.clip((after * before).sum(axis=1) / length2, 0.0, 1.0)
        rise = np.linalg.norm(after - share[:, None] * before, axis=1)
        elapsed_s = np.clip(np.diff(rows["tick"]), 1, 5) * period_s
        allowed = self._servo.options.safety.slew_n_per_s * elapsed_s
        sizes = np.linalg.norm(after, axis=1)
        self.ticks += len(after)
        self.forced += int((sizes > 0).sum())
        self.greatest_n = max(self.greatest_n, float(sizes.max()))
        self.greatest_rise = max(self.greatest_rise, float((rise / allowed).max()))
