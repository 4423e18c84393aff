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
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._simulated_flaws import FLAWS, Block, Flaw, Given, simulated
from benchmarks.evidence import Figure, rates
from benchmarks.timing import table
from diagnose.options import AttributionOptions, DiagnoseOptions
from diagnose.other_simulator.forces import Forces, ForcesOptions
from diagnose.other_simulator.pipeline import Asked, diagnose_simulated
from diagnose.other_simulator.result import SimulatedGap
from diagnose.other_simulator.stated import KEYS, Stated
from diagnose.pipeline import diagnose
from diagnose.verdict.result import Diagnosis
from mechanics.errors import OptionError
from mechanics.model.model import Model
from mechanics.recording.recording import Recording
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
    parser.add_argument(
        "--work", type=Path, help="folder that keeps every judged case; all that lie there are counted"
    )


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
        """Numerics and parameters that the verdict names, as it orders them."""
        own = {n for part in ("numerics", "parameters") for n in self.verdict.parts[part].names}
        return [n for n in self.verdict.effects if n in own]

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
    world = cache(lambda late: _world(block, late))
    drawn = np.random.default_rng(arguments.seed)
    plan = [_single(drawn, k) for k in range(arguments.singles)]
    plan += [_pair(drawn) for _ in range(arguments.pairs)] + [()] * arguments.controls
    rows: dict[str, dict[str, Any]] = {}
    if arguments.work is not None:
        arguments.work.mkdir(parents=True, exist_ok=True)
        rows = {path.stem: json.loads(path.read_text()) for path in sorted(arguments.work.glob("*.json"))}
        _check_seals(list(rows.values()))
    with progress_bar("cases") as tell:
        # a mixture from the first on, as a run may be ended early
        for k, number in enumerate(drawn.permutation(len(plan))):
            tell("cases", k / len(plan))
            name = f"{arguments.seed}-{number}"
            if name in rows:
                continue
            seed = 1000 * arguments.seed + int(number)
            rows[name] = _row(_judged(block, world(number % 3 == 2), plan[number], seed, int(number)))
            if arguments.work is not None:
                (arguments.work / f"{name}.json").write_text(json.dumps(rows[name], indent=1, default=float))
    return _said(list(rows.values()))


def _said(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Print every case and the counts; the figures with the cases."""
    _print(rows)
    figures = _figures(rows)
    said = [[f.what, f"{f.value:.3g} {f.unit}", f.target] for f in figures]
    print(table(["figure", "value", "target"], said))
    return {"figures": figures, "cases": rows}


def _check_seals(rows: Sequence[dict[str, Any]]) -> None:
    broken = [k for k, row in enumerate(rows) if digest(row["truth"], row["salt"]) != row["sealed"]]
    if broken:
        raise OptionError(f"cases {broken} are not what was sealed: judge them again")


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


def _print(rows: Sequence[dict[str, Any]]) -> None:
    lines = []
    for number, row in enumerate(rows):
        said = " ".join(f"{name}={x:.3g}" for name, x in row["truth"]["flaws"]) or "none"
        left = row["said_left_n"]
        lines.append(
            [number, said, f"{row['times_visible']:.1f}", " ".join(row["named"]) or "none",
             " ".join(row["candidates"]), f"{row['gap_n']:.3f}", "-" if left is None else f"{left:.3f}",
             f"{row['left_n']:.3f}"]
        )  # fmt: skip
    print(table(["case", "planted", "times visible", "named", "or", "gap [N]", "said left", "left"], lines))


def _truth(row: dict[str, Any]) -> list[str]:
    """Names of what was planted, the largest first."""
    return sorted(row["sizes_n"], key=lambda n: -row["sizes_n"][n])


def _strictly(row: dict[str, Any]) -> bool:
    """Whether the largest flaw is named first."""
    return row["named"][:1] == _truth(row)[:1]


def _first(row: dict[str, Any]) -> bool:
    """The same, or it is a candidate beside what is named."""
    return _strictly(row) or (bool(row["named"]) and _truth(row)[0] in row["candidates"])


def _all_of(row: dict[str, Any]) -> bool:
    """Whether everything planted is named or a candidate."""
    return set(_truth(row)) <= {*row["named"], *row["candidates"]}


def _figures(rows: Sequence[dict[str, Any]]) -> list[Figure]:
    single = [r for r in rows if len(r["sizes_n"]) == 1]
    far = [r for r in single if r["times_visible"] >= FAR]
    pairs = [r for r in rows if len(r["sizes_n"]) == 2]
    controls = [r for r in rows if not r["sizes_n"]]
    counted = {
        f"first place, one flaw of {FAR:g} times what can be seen": (sum(map(_first, far)), len(far)),
        "first place strictly, the same": (sum(map(_strictly, far)), len(far)),
        "in names or candidates, the same": (sum(map(_all_of, far)), len(far)),
        "only that flaw named, the same": (sum(r["named"] == _truth(r) for r in far), len(far)),
        "first place, one flaw of any size": (sum(map(_first, single)), len(single)),
        "dominant of pairs": (sum(map(_first, pairs)), len(pairs)),
        "both of pairs in names or candidates": (sum(map(_all_of, pairs)), len(pairs)),
        "false alarms on controls": (sum(bool(r["named"]) for r in controls), len(controls)),
        "parts and the rest add up to 1": (sum(r["adds_up"] for r in rows), len(rows)),
    }
    targets = {"first place, one flaw of 4": 85.0, "dominant of pairs": 90.0, "parts and": 100.0}
    figures = []
    for figure in rates(counted):
        least = next((t for name, t in targets.items() if figure.what.startswith(name)), None)
        if figure.what.startswith("false alarms"):
            figure = figure.at_most(2.0)
        figures.append(figure if least is None else figure.at_least(least))
    off = []
    for r in rows:
        measured = r["gap_n"] ** 2 - r["left_n"] ** 2
        # where mending it changes nothing to speak of there is no shrinkage to predict
        if r["said_left_n"] is not None and measured > 0.1 * r["gap_n"] ** 2:
            off.append(abs((r["gap_n"] ** 2 - r["said_left_n"] ** 2) / measured - 1))
    if off:
        low, high = np.quantile(off, [0.25, 0.75])
        what = f"shrinkage predicted against measured, median of {len(off)} (quartiles)"
        spread = (100 * float(low), 100 * float(high))
        figures.append(Figure(what, 100 * float(np.median(off)), spread, "%").at_most(15.0))
    return figures


def _predicted(case: _Case) -> float | None:
    """N, the gap that was said to be left once the largest flaw is mended."""
    known = {e.name: e.gap_after_n for e in case.verdict.entries}
    return known.get(case.truth[0]) if case.truth and case.truth[0] in case.named else None


def _row(case: _Case) -> dict[str, Any]:
    verdict = case.verdict
    whole = sum(part.share for part in verdict.parts.values()) + verdict.unexplained
    return {
        "truth": {"flaws": [[f.name, x] for f, x in case.planted]}, "salt": case.salt, "sealed": case.sealed,
        "late_sensor": case.late, "sizes_n": case.sizes, "times_visible": case.visible,
        "left_n": case.left_n, "kind": verdict.kind, "named": case.named,
        "candidates": list(verdict.candidates), "reality": list(verdict.parts["reality"].names),
        "shares": {name: part.share for name, part in verdict.parts.items()},
        "said_left_n": _predicted(case), "gap_n": verdict.gap_before_n,
        "adds_up": bool(abs(whole - 1) < 1e-9),
    }  # fmt: skip
