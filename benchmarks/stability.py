"""Stability of the loop: simulated hands on an elastic plane, through the servo's tick, in virtual time.

Every combination of hand, modulus, rate, quantisation and delay is pressed, held, let go and tapped; what
counts is the greatest net energy that the hand ever got back (aim: at most 1 mJ), and what staying stable
cost: the share of the force that the controller changed, and the share of its stiffness that the plane lost
to the virtual coupling. The same grid without controller and coupling stands beside it. A smaller second grid
drags one tip and two with friction over a dome of silicone (benchmarks/_stability_objects.py).
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
from typing import Any

import numpy as np

from benchmarks import _stability_objects
from benchmarks._closed_loop import ClosedLoopResult, Loop, closed_loop, side_by_side
from benchmarks._elastic_plane import ElasticPlane
from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.devices.impedance import HandImpedance
from palpate.devices.virtual_hand import SPEC
from palpate.render.passivity import PassivityOptions

AIM_J = 1e-3
TIP_RADIUS_M, TYPICAL_DEPTH_M = 0.005, 0.003
IMPEDANCES = ((0.0, 0.0), (2.0, 200.0), (12.0, 600.0), (5.0, 2000.0))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The grid."""

    def numbers(text: str) -> tuple[float, ...]:
        return tuple(float(part) for part in text.split(","))

    for flag, default, words in (
        ("--moduli", (20e3, 100e3, 1e6), "Young's moduli [Pa]"),
        ("--masses", (0.05, 0.2, 0.5), "masses of hand and tool [kg]"),
        ("--rates", (500.0, 1000.0, 2000.0), "ticks a second [Hz]"),
        ("--quantisation", (0.0, 5e-5), "steps of the position [m]"),
        ("--delays", (0.0, 1e-3, 2e-3, 4e-3), "from a pose to its force [s]"),
    ):
        shown = ",".join(f"{value:g}" for value in default)
        parser.add_argument(flag, type=numbers, default=default, help=f"{words} (default: {shown})")
    parser.add_argument("--no-dome", action="store_true", help="leave the grid on the dome out")


def plane_stiffness_n_per_m(young_modulus_pa: float) -> float:
    """Hertz' tangent of a tip of 5 mm at 3 mm depth in an incompressible half space."""
    return 2.0 * young_modulus_pa / 0.75 * float(np.sqrt(TIP_RADIUS_M * TYPICAL_DEPTH_M))


def press_hold_release(rate_hz: float, *, depth_m: float = 0.006, times: int = 2) -> np.ndarray:
    """(n + 1, 3) m: half a second above the plane (the ramp), then presses at up to 0.15 m/s."""
    high, low = 0.008, 0.005 - depth_m
    stroke = max(int((high - low) / 0.1 * rate_hz), 2)
    s = np.arange(1, stroke + 1) / stroke
    smooth = s * s * (3.0 - 2.0 * s)
    z = [np.full(int(0.55 * rate_hz), high)]
    for _ in range(times):
        z += [high - (high - low) * smooth, np.full(int(0.2 * rate_hz), low)]
        z += [low + (high - low) * smooth, np.full(int(0.1 * rate_hz), high)]
    path = np.zeros((sum(map(len, z)), 3))
    path[:, 2] = np.concatenate(z)
    return path


def thrown(rate_hz: float) -> np.ndarray:
    """(n + 1, 3) m: a free mass starts 65 mm up (0.6 s of ramp at 0.1 m/s), and one second passes."""
    path = np.zeros((int(rate_hz) + 1, 3))
    path[:, 2] = 0.065
    return path


def one(
    modulus: float, mass: float, impedance: tuple[float, float], loop: Loop, *, active: bool
) -> ClosedLoopResult:
    """One combination."""
    damping, stiffness = impedance
    free = stiffness == 0.0
    return closed_loop(
        ElasticPlane(plane_stiffness_n_per_m(modulus)),
        SPEC,
        HandImpedance(mass, damping, stiffness),
        thrown(loop.rate_hz) if free else press_hold_release(loop.rate_hz),
        loop=dataclasses.replace(loop, coupling=active, passivity=PassivityOptions(passivity=active)),
        thrown_m_per_s=np.array([0.0, 0.0, -0.1]) if free else None,
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Run the grid and print its table."""
    cases = []
    grid = itertools.product(
        arguments.moduli,
        arguments.masses,
        IMPEDANCES,
        arguments.rates,
        arguments.quantisation,
        arguments.delays,
    )
    for modulus, mass, impedance, rate, quantum, delay in grid:
        loop = Loop(rate, quantum, delay)
        off, on = (one(modulus, mass, impedance, loop, active=active) for active in (False, True))
        about = {
            "young_modulus_pa": modulus, "mass_kg": mass, "damping_n_s_per_m": impedance[0],
            "stiffness_n_per_m": impedance[1], "rate_hz": rate, "quantisation_m": quantum, "delay_s": delay,
        }  # fmt: skip
        cases.append(side_by_side(off, on, **about))
    result: dict[str, Any] = {"aim_j": AIM_J, "cases": cases}
    by = ("delay_s", "rate_hz", "young_modulus_pa", "mass_kg", "stiffness_n_per_m", "quantisation_m")
    result["by"] = _report("pressed and tapped plane", cases, by)
    if not arguments.no_dome:
        result["dome_cases"] = _stability_objects.cases()
        by = ("delay_s", "young_modulus_pa", "mass_kg", "friction", "tips", "quantisation_m")
        result["dome_by"] = _report("dome, dragged over", result["dome_cases"], by)
    result["figures"] = [
        Figure(f"{words}: energy given back to the hand, worst of {len(own)}",
               1e3 * max(case["given_back_j"] for case in own), unit="mJ").at_most(1e3 * AIM_J)
        for words, own in (("plane", cases), ("dome", result.get("dome_cases", [])))
        if own
    ]  # fmt: skip
    return result


def _report(title: str, cases: list[dict[str, Any]], by: tuple[str, ...]) -> dict[str, list[Any]]:
    rows = [_summary("all", cases)]
    for name in by:
        for value in sorted({case[name] for case in cases}):
            rows.append(_summary(f"{name} {value:g}", [c for c in cases if c[name] == value]))
    header = [title, "number", "worst unguarded mJ", "over 1 mJ", "worst mJ", "over 1 mJ"]
    header += ["force changed, median", "force changed, p90", "stiffness lost, median"]
    print(table(header, rows))
    return {row[0]: row[1:] for row in rows}


def _summary(name: str, cases: list[dict[str, Any]]) -> list[Any]:
    off = np.array([c["given_back_unguarded_j"] for c in cases])
    on = np.array([c["given_back_j"] for c in cases])
    changed = np.array([c["force_distortion"] for c in cases])
    lost = np.array([c["stiffness_lost"] for c in cases])
    return [
        name,
        len(cases),
        1e3 * float(off.max()),
        int((off > AIM_J).sum()),
        1e3 * float(on.max()),
        int((on > AIM_J).sum()),
        float(np.median(changed)),
        float(np.percentile(changed, 90)),
        float(np.median(lost)),
    ]
