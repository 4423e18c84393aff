"""Another simulator's gap: are its flaws named, and does the gap shrink as was said?

Flaws are planted one by one and in pairs, at drawn strengths, in forces of our own law on a pressed block
that leave it beside as another good solver's do (2 % a place, 0.1 mm of first touch, 1 mN). The truth of each
case is sealed by a salted hash before its verdict. A control has no flaw. A third of the cases is measured by
a sensor that reads late: that is no flaw of the simulator.

First place: the flaw that changes the force most is named first, or as a candidate beside it. Shrinkage: the
gap that was said to be left once that flaw is mended, against the one of the same simulation without it.
"""

from __future__ import annotations

import argparse
import json
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks._simulated_flaws import FLAWS, Block, Flaw, Given, simulated
from benchmarks.evidence import Figure, rates
from benchmarks.timing import table
from diagnose.options import AttributionOptions, DiagnoseOptions
from diagnose.pipeline import diagnose
from diagnose.simulated.forces import Forces, ForcesOptions
from diagnose.simulated.pipeline import Asked, diagnose_simulated
from diagnose.simulated.result import SimulatedGap
from diagnose.simulated.stated import KEYS, Stated
from diagnose.verdict.result import Diagnosis
from mechanics.model import Model
from mechanics.recording import Recording
from palpate.output import progress_bar
from scenes.laboratory.sealing import digest

LATE_S = 0.03
FAR = 4.0
"""Times what can be seen at all, from which the targets hold."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How many cases of each kind."""
    parser.add_argument("--singles", type=int, default=39, help="cases with one flaw")
    parser.add_argument("--pairs", type=int, default=12, help="cases with two")
    parser.add_argument("--controls", type=int, default=12, help="cases with none")
    parser.add_argument("--seed", type=int, default=0, help="of all that is drawn")


@dataclass(frozen=True)
class _Reality:
    recording: Recording
    model: Model
    diagnosis: Diagnosis
    late: bool


@dataclass(frozen=True)
class _Case:
    """sizes: by flaw the N rms by which it changes the force. left_n: the gap without the largest one."""

    number: int
    planted: tuple[tuple[Flaw, float], ...]
    sizes: dict[str, float]
    left_n: float
    sealed: str
    salt: str
    verdict: SimulatedGap
    late: bool

    @property
    def truth(self) -> list[str]:
        """Names, the largest first."""
        return sorted(self.sizes, key=lambda n: -self.sizes[n])

    @property
    def named(self) -> list[str]:
        """Numerics and parameters that the verdict names, strongest first."""
        return [*self.verdict.parts["numerics"].names, *self.verdict.parts["parameters"].names]

    @property
    def visible(self) -> float:
        """Size of the largest over what can be seen of it."""
        if not self.truth:
            return 0.0
        limits = {e.name: e.detectable_n for e in self.verdict.entries if np.isfinite(e.detectable_n)}
        least = 0.02 * float(np.sqrt((self.verdict.simulated**2).sum(axis=1).mean()))
        return self.sizes[self.truth[0]] / max(limits.get(self.truth[0], least), least)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Plant, seal, judge, open; print what was found."""
    block = Block()
    worlds = [_world(block, late) for late in (False, False, True)]
    drawn = np.random.default_rng(arguments.seed)
    plan = [_single(drawn, k) for k in range(arguments.singles)]
    plan += [_pair(drawn) for _ in range(arguments.pairs)] + [()] * arguments.controls
    cases = []
    with progress_bar("cases") as tell:
        for number, planted in enumerate(plan):
            tell("cases", number / len(plan))
            world = worlds[number % 3]
            cases.append(_judged(block, world, planted, 1000 * arguments.seed + number, number))
    _print(cases)
    figures = _figures(cases)
    print(
        table(["figure", "value", "target"], [[f.what, f"{f.value:.3g} {f.unit}", f.target] for f in figures])
    )
    return {"figures": figures, "cases": [_row(case) for case in cases]}


def _world(block: Block, late: bool) -> _Reality:
    force = block.force()
    if late:
        force = np.column_stack([np.interp(block.t - LATE_S, block.t, f) for f in force.T])
    recording, model = block.measured(np.random.default_rng(int(late)), force)
    return _Reality(recording, model, diagnose(recording, model, DiagnoseOptions(fast=True)), late)


def _strength(flaw: Flaw, rng: np.random.Generator) -> float:
    low, high = flaw.strengths
    if flaw.name == "stated_poisson_ratio":
        return float(rng.choice([0.30, 0.40, 0.46]))  # each is a factorisation
    strength = float(np.exp(rng.uniform(np.log(low), np.log(high))))
    if flaw.name in ("stated_modulus", "stated_tip_radius", "mesh_stiffness") and rng.random() < 0.4:
        return 1 / strength
    return -strength if flaw.name == "contact_offset" and rng.random() < 0.4 else strength


def _single(rng: np.random.Generator, k: int) -> tuple[tuple[Flaw, float], ...]:
    flaw = FLAWS[k % len(FLAWS)]
    return ((flaw, _strength(flaw, rng)),)


def _pair(rng: np.random.Generator) -> tuple[tuple[Flaw, float], ...]:
    one, two = rng.choice(len(FLAWS), 2, replace=False)
    return tuple((FLAWS[i], _strength(FLAWS[i], rng)) for i in sorted((one, two)))


def _judged(
    block: Block, world: _Reality, planted: Sequence[tuple[Flaw, float]], seed: int, number: int
) -> _Case:
    clean, _ = simulated(block, (), seed)
    force, given = simulated(block, planted, seed)
    counted = world.model.presses.touching(world.recording.t)
    measured = world.recording.force_on_tool[counted]

    def rms(f: np.ndarray) -> float:
        return float(np.sqrt((f**2).sum(axis=1).mean()))

    sizes = {f.name: rms((simulated(block, [(f, x)], seed)[0] - clean)[counted]) for f, x in planted}
    largest = max(sizes, key=lambda n: sizes[n], default="")
    rest, _ = simulated(block, [(f, x) for f, x in planted if f.name != largest], seed)
    salt = secrets.token_hex(16)
    sealed = digest({"flaws": [[f.name, x] for f, x in planted]}, salt)
    asked = Asked(Forces(block.t, force, "planted"), _stated(given), ForcesOptions(clock_offset_s=0.0))
    verdict = diagnose_simulated(
        world.recording, world.model, asked, DiagnoseOptions(bootstrap=100), reality=world.diagnosis,
        attribution=AttributionOptions(most=2),
    )  # fmt: skip
    left = rms(measured - rest[counted])
    return _Case(number, tuple(planted), sizes, left, sealed, salt, verdict, world.late)


def _stated(given: Given) -> Stated:
    return Stated(given.modulus_pa, given.poisson, given.friction, given.radius_m, frozenset(KEYS))


def _print(cases: Sequence[_Case]) -> None:
    rows = []
    for case in cases:
        said = " ".join(f"{f.name}={x:.3g}" for f, x in case.planted) or "none"
        rows.append(
            [case.number, said, f"{case.visible:.1f}", " ".join(case.named) or "none",
             " ".join(case.verdict.candidates), f"{case.verdict.gap_before_n:.3f}",
             f"{_predicted(case) or float('nan'):.3f}", f"{case.left_n:.3f}"]
        )  # fmt: skip
    print(table(["case", "planted", "times visible", "named", "or", "gap [N]", "said left", "left"], rows))


def _predicted(case: _Case) -> float | None:
    """N, the gap that was said to be left once the largest flaw is mended."""
    known = {e.name: e.gap_after_n for e in case.verdict.entries}
    return known.get(case.truth[0]) if case.truth and case.truth[0] in case.named else None


def _first(case: _Case) -> bool:
    """Whether the largest flaw stands first, or as a candidate of what does."""
    return case.named[:1] == case.truth[:1] or (bool(case.named) and case.truth[0] in case.verdict.candidates)


def _figures(cases: Sequence[_Case]) -> list[Figure]:
    single = [c for c in cases if len(c.planted) == 1]
    far = [c for c in single if c.visible >= FAR]
    pairs = [c for c in cases if len(c.planted) == 2]
    controls = [c for c in cases if not c.planted]
    counted = {
        f"first place, one flaw of {FAR:g} times what can be seen": (sum(map(_first, far)), len(far)),
        "first place strictly, the same": (sum(c.named[:1] == c.truth[:1] for c in far), len(far)),
        "in names or candidates, the same": (
            sum(c.truth[0] in (*c.named, *c.verdict.candidates) for c in far), len(far),
        ),
        "first place, one flaw of any size": (sum(map(_first, single)), len(single)),
        "only the flaw named, one flaw of that size": (sum(c.named == c.truth for c in far), len(far)),
        "dominant of pairs": (sum(map(_first, pairs)), len(pairs)),
        "both of pairs": (
            sum(set(c.truth) <= {*c.named, *c.verdict.candidates} for c in pairs), len(pairs),
        ),
        "false alarms on controls": (sum(bool(c.named) for c in controls), len(controls)),
        "parts and the rest add up to 1": (sum(map(_adds_up, cases)), len(cases)),
    }  # fmt: skip
    targets = {"first place, one flaw of 4": 85.0, "dominant of pairs": 90.0, "parts and": 100.0}
    figures = []
    for figure in rates(counted):
        least = next((t for name, t in targets.items() if figure.what.startswith(name)), None)
        if figure.what.startswith("false alarms"):
            figure = figure.at_most(2.0)
        figures.append(figure if least is None else figure.at_least(least))
    off = [
        abs((c.verdict.gap_before_n**2 - p**2) / (c.verdict.gap_before_n**2 - c.left_n**2) - 1)
        for c in cases if (p := _predicted(c)) is not None and c.left_n < 0.95 * c.verdict.gap_before_n
    ]  # fmt: skip
    if off:
        low, high = np.quantile(off, [0.25, 0.75])
        figures.append(
            Figure(
                f"shrinkage predicted against measured, median of {len(off)} (quartiles)",
                100 * float(np.median(off)), (100 * float(low), 100 * float(high)), "%",
            ).at_most(15.0)
        )  # fmt: skip
    return figures


def _adds_up(case: _Case) -> bool:
    parts = case.verdict.parts
    return abs(sum(p.share for p in parts.values()) + case.verdict.unexplained - 1) < 1e-9


def _row(case: _Case) -> dict[str, Any]:
    truth = {"flaws": [[f.name, x] for f, x in case.planted]}
    return {
        "truth": truth, "salt": case.salt, "sealed": case.sealed, "late_sensor": case.late,
        "sizes_n": case.sizes, "times_visible": case.visible, "left_n": case.left_n,
        "verdict": json.loads(json.dumps(case.verdict.as_json()["verdict"])),
        "named": case.named, "said_left_n": _predicted(case), "gap_n": case.verdict.gap_before_n,
    }  # fmt: skip
