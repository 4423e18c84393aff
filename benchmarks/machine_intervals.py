"""Do the intervals of bench curves hold? Drawn sets of curves of a sphere, judged by `palpate material`.

A set is of one piece: one to five curves (eight with --many) by one law of the dent, on a rigid machine or
on one of two to five times the contact's stiffness, with noise and zeros of travel and force; in every other
set free air slopes, and in every other one moduli differ from curve to curve by 0.3 to 15 %. A load cell, a
travel and a tip are off as instruments are (`_GAIN`, `_TRAVEL`, `_TIP`; not with --true). Counted is how
often the 95 % interval of the modulus holds the truth, and how often a machine that yields is named, which
moves the modulus by more than 3 % in all of them.
"""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.evidence import Figure, rates
from benchmarks.timing import table
from palpate.diagnosis.specimen.bench import MachineCycle
from palpate.diagnosis.specimen.material import material_of
from palpate.diagnosis.specimen.result import MachineTests
from palpate.mechanics.contact.dent import dent_law
from palpate.mechanics.contact.tip import Tip
from palpate.mechanics.effects.tool_compliance import EFFECT as TOOL

_GAIN, _TRAVEL, _TIP = 0.005, 0.005, 0.01
"""Standard deviations of a load cell's and a travel's gain and of a tip's radius, in shares: 1 % of E."""
_LAWS = ("sphere", "hertz", "linear", "neo-hookean")


@dataclass(frozen=True)
class Bench:
    """A drawn set. stiffness: of the machine over the contact's at the deepest peak, infinite of a rigid one.
    slope: of free air over the depth of the dent, over the peak. apart: standard deviation of ln E between
    curves."""

    curves: tuple[MachineCycle, ...]
    tip: Tip
    law: str
    young_modulus_pa: float
    stiffness: float
    noise: float
    slope: float
    apart: float


def drawn(seed: int, *, many: bool = False, true: bool = False) -> Bench:
    """The set of that seed. many: eight curves; true: the instrument is what it says."""
    rng = np.random.default_rng([47, seed])
    modulus = float(np.exp(rng.uniform(np.log(2e3), np.log(3e6))))
    radius = float(rng.choice([0.5e-3, 1e-3, 2.5e-3, 5e-3]))
    law, count = str(rng.choice(_LAWS)), 8 if many else int(rng.choice([1, 2, 3, 5]))
    noise = float(np.exp(rng.uniform(np.log(5e-4), np.log(1e-2))))
    slope = float(rng.choice([0.0, rng.uniform(0.02, 0.2) * rng.choice([-1, 1])]))
    stiffness = float(rng.choice([np.inf, rng.uniform(2, 5), rng.uniform(2, 5)]))
    apart = float(rng.choice([0.0, np.exp(rng.uniform(np.log(3e-3), np.log(0.15)))]))
    apart *= count > 1  # one curve tells of its own place alone
    rows, deep = int(rng.integers(150, 600)), radius * rng.uniform(0.1, 0.35)
    air = rng.uniform(0.15, 0.5) * deep
    gain, ruler, tip = (1 + s * rng.standard_normal() for s in (_GAIN, _TRAVEL, _TIP))
    if true:
        gain = ruler = tip = 1.0

    def push(dent: np.ndarray) -> np.ndarray:
        return np.asarray(dent_law(law).force(np.maximum(dent, 0.0), modulus, 0.49, tip * radius))

    peak = float(push(np.array([deep]))[0])
    contact = float(np.diff(push(np.array([0.995, 1.005]) * deep))[0]) / (0.01 * deep)
    curves = []
    for k in range(count):
        deepest = deep * rng.uniform(0.8, 1.0)
        way = np.linspace(-air, deepest, rows)
        dent = np.concatenate([way, way[::-1]])
        force = push(dent) * float(np.exp(apart * rng.standard_normal()))
        travel = ruler * (dent + force / (stiffness * contact))
        read = gain * force + slope * peak / deep * (travel - travel[0])
        read += noise * peak * rng.standard_normal(len(force)) + rng.uniform(-0.2, 0.2) * peak
        curves.append(
            MachineCycle(np.arange(len(dent)) / 50, travel + rng.uniform(-5, 5) * deep, read, f"{k}")
        )
    return Bench(tuple(curves), Tip("sphere", radius), law, modulus, stiffness, noise, slope, apart)


def judged(bench: Bench) -> dict[str, Any]:
    """What the program says of a set, and whether that is true."""
    tests = MachineTests("indentation", curves=bench.curves, tip=bench.tip)
    made = material_of(tests, [c.name for c in bench.curves], poisson_ratio=0.49, fast=True)
    low, high = made.young_modulus_ci95_pa
    e = bench.young_modulus_pa
    return {
        "error": made.young_modulus_pa / e - 1,
        "half": float(np.log(high / low)) / 2,
        "side": "below" if e < low else "above" if e > high else "",
        "named": TOOL.name in made.effects,
        "effects": made.effects,
        "law": made.law,
    }


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How many sets, and which."""
    parser.add_argument("--sets", type=int, default=100, help="how many (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the first (default: %(default)s)")
    parser.add_argument("--many", action="store_true", help="eight curves, each held out")
    parser.add_argument("--true", action="store_true", help="instruments are what they say")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Draw, judge, count."""
    counted: Counter[str] = Counter()
    misses, errors, halves = [], [], []
    for seed in range(arguments.seed, arguments.seed + arguments.sets):
        bench = drawn(seed, many=arguments.many, true=arguments.true)
        said = judged(bench)
        yields = bool(np.isfinite(bench.stiffness))
        kind = "yielding" if yields else "rigid"
        held = not said["side"]
        counted.update({"all": 1, kind: 1, f"{kind} {len(bench.curves)}": 1, f"law {bench.law}": 1})
        if held:
            counted.update({"all held": 1, f"{kind} held": 1, f"law {bench.law} held": 1})
        counted[f"{kind} named"] += said["named"]
        errors.append(abs(said["error"]))
        halves.append(said["half"])
        row = [seed, kind, len(bench.curves), bench.law, said["law"], f"{100 * bench.noise:.2g}",
               f"{100 * bench.slope:.2g}", f"{100 * said['error']:+.2f}", f"{100 * said['half']:.2f}",
               said["side"], ", ".join(said["effects"])]  # fmt: skip
        if not held or said["named"] != yields:
            misses.append(row)
    head = [
        "seed",
        "machine",
        "curves",
        "law",
        "told",
        "noise %",
        "slope %",
        "error %",
        "half %",
        "truth",
        "named",
    ]
    print(table(head, misses))
    total = counted["all"]
    figures = rates(
        {
            "intervals that hold the truth": (counted["all held"], total),
            **{
                f"of them, {kind} machine": (counted[f"{kind} held"], counted[kind])
                for kind in ("rigid", "yielding")
            },
            **{f"of them, by {law}": (counted[f"law {law} held"], counted[f"law {law}"]) for law in _LAWS},
            "machines that yield, named": (counted["yielding named"], counted["yielding"]),
            "rigid machines, named as yielding": (counted["rigid named"], counted["rigid"]),
        }
    )
    figures[0] = figures[0].at_least(92)
    figures += [
        Figure("error of the modulus, median", 100 * float(np.median(errors)), unit="%"),
        Figure("half of the interval, median", 100 * float(np.median(halves)), unit="%"),
    ]
    return {"misses": misses, "figures": figures}
