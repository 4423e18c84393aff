"""The servo's tick: compute time for 1 to 32 frictional contacts, and late ticks against an empty loop.

Wall times of a tick include what neighbours on a shared machine steal; CPU times of the same ticks stand
beside them. Late ticks (started 0.2 ms or more after their deadline) are counted in alternating slices with
an empty loop, in the same run: bare, and with a window's reading and drawing and a recording beside it.
"""

from __future__ import annotations

import argparse
import threading
import time
from typing import Any

import numpy as np

from benchmarks._elastic_plane import FreeAir
from benchmarks._servo_load import LATE_NS, Load, Measured, renderer_of
from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.servo.report import ring_rows, snapshot

AIMS_US = {1: 100.0, 16: 300.0}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Sizes and lengths."""
    parser.add_argument("--nodes", type=int, nargs="+", default=[1000, 5000], help="touchable nodes, about")
    parser.add_argument("--contacts", type=int, nargs="+", default=[1, 4, 16, 32])
    parser.add_argument("--ticks", type=int, default=20_000, help="ticks a compute-time figure")
    parser.add_argument("--seconds", type=float, default=10.0, help="of each real-time loop, in 1 s slices")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure, print, return."""
    result: dict[str, Any] = {"compute": [], "late": [], "late_threshold_us": LATE_NS / 1000.0}
    renderers = {}
    for nodes in arguments.nodes:
        renderers[nodes] = renderer_of(nodes)
        touchable = int(renderers[nodes][0].model.mesh.touchable.sum())
        for contacts in arguments.contacts:
            load = Load(*renderers[nodes], contacts)
            load.run(min(2000, arguments.ticks), wait=False)
            load = Load(*renderers[nodes], contacts)
            load.run(arguments.ticks, wait=False)
            result["compute"].append(
                {"touchable_nodes": touchable, "contacts": contacts, **_figures(load.measured())}
            )
    _print_compute(result["compute"])
    renderer, path = renderers[arguments.nodes[-1]]
    for beside in ("nothing", "window and recording"):
        loads = {"empty loop": Load(FreeAir(), path, 1)}
        loads |= {f"{n} contact{'s' * (n > 1)}": Load(renderer, path, n) for n in (1, 16)}
        word = _alternate(loads, arguments.seconds, renderer, beside != "nothing")
        base = loads["empty loop"].measured()
        for name, load in loads.items():
            seen = load.measured()
            result["late"].append(
                {
                    "beside": beside,
                    "loop": name,
                    "ticks": seen.ticks,
                    "late": seen.late,
                    "missed": seen.missed,
                    "ratio_to_empty": seen.late / base.late if base.late else None,
                    "lateness_us": seen.lateness.as_json(),
                    "cpu_s": seen.cpu_s,
                    "wall_s": seen.wall_s,
                    "real_time": word or "SCHED_FIFO",
                }
            )
    _print_late(result["late"])
    result["figures"] = [_kept(row, name) for row in result["compute"] for name in ("median", "p99.9")]
    return result


def _kept(row: dict[str, Any], name: str) -> Figure:
    contacts, nodes = row["contacts"], row["touchable_nodes"]
    figure = Figure(
        f"CPU of a tick, {contacts} contacts, {nodes} nodes, {name}", row["cpu_us"][name], unit="us"
    )
    return figure.at_most(AIMS_US[contacts]) if name == "p99.9" and contacts in AIMS_US else figure


def _figures(seen: Measured) -> dict[str, Any]:
    return {
        "wall_us": seen.compute.as_json(),
        "cpu_us": seen.cpu.as_json(),
        "cpu_s": seen.cpu_s,
        "wall_s": seen.wall_s,
        "ticks": seen.ticks,
    }


def _alternate(loads: dict[str, Load], seconds: float, renderer: Any, busy: bool) -> str:
    """One second of each in turn, so that whatever else the machine does meets all alike."""
    stop, word = threading.Event(), ""
    current: list[Load] = [next(iter(loads.values()))]
    helper = threading.Thread(target=_window_and_recording, args=(stop, current, renderer))
    if busy:
        helper.start()
    try:
        for _ in range(max(1, round(seconds))):
            for load in loads.values():
                current[0] = load
                word = load.run_in_real_time(1000)
    finally:
        stop.set()
        if busy:
            helper.join()
    return word


def _window_and_recording(stop: threading.Event, current: list[Load], renderer: Any) -> None:
    """What a window does 30 times a second: read tick and ring, move the surface, keep rows."""
    kept_rows: list[np.ndarray] = []
    while not stop.is_set():
        shared = current[0].shared
        seen = snapshot(shared)
        rows, _ = ring_rows(shared, max(0, int(shared.ring_head[0]) - 40))
        kept_rows.append(rows)
        if seen is not None and seen.touching.any():
            radii = np.full(len(seen.depths), renderer.model.tool.tip_radius_m)
            renderer.displacement_of(seen.points, seen.normals, seen.forces_n, radii, seen.depths)
        time.sleep(1.0 / 30.0)


def _print_compute(rows: list[dict[str, Any]]) -> None:
    header = ["touchable nodes", "contacts", "wall median us", "p99", "p99.9", "max"]
    header += ["CPU median us", "p99", "p99.9", "max", "aim p99.9"]
    shown = [
        [
            row["touchable_nodes"],
            row["contacts"],
            *(row["wall_us"][q] for q in ("median", "p99", "p99.9", "max")),
            *(row["cpu_us"][q] for q in ("median", "p99", "p99.9", "max")),
            AIMS_US.get(row["contacts"], "-"),
        ]
        for row in rows
    ]
    print(table(header, shown))


def _print_late(rows: list[dict[str, Any]]) -> None:
    header = ["beside", "loop", "ticks", "late", "missed", "late / empty", "lateness p99 us", "p99.9", "max"]
    header += ["CPU s", "wall s"]
    shown = [
        [
            row["beside"],
            row["loop"],
            row["ticks"],
            row["late"],
            row["missed"],
            "-" if row["ratio_to_empty"] is None else row["ratio_to_empty"],
            *(row["lateness_us"][q] for q in ("p99", "p99.9", "max")),
            row["cpu_s"],
            row["wall_s"],
        ]
        for row in rows
    ]
    print(table(header, shown))
    print(f"real-time scheduling: {rows[0]['real_time']}; late: over {LATE_NS / 1000:.0f} us")
