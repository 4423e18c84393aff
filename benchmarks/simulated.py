"""Another simulator's gap: are its flaws named, and does the gap shrink as was said?

Flaws are planted one by one and in pairs, at drawn strengths, in forces of our own law on a pressed block
that leave it beside as another good solver's do (2 % a place, 0.1 mm of first touch, 1 mN). The truth of each
case is sealed by a salted hash before its verdict. A control has no flaw. A third of the cases is measured by
a sensor that reads late: that is no flaw of the simulator.

First place: the flaw that changes the force most, alone, is named first, or as a candidate beside it.
Shrinkage: the gap that was said to be left once that flaw is mended, against the one of the same simulation
without it.

--adapter NAME plants them in another simulator instead (`_adapter_flaws`): its settings made worse, its
parameters wrong, over a control that is as resolved as can be afforded, and judged against that control
given the same parameters (`diagnose --baseline`). A flaw is said by any name whose advice mends the setting
that was changed (an element's size: mesh stiffness or contact nodes). What the control is named for is the
simulator's own: it counts as a false alarm where the control's force is within 5 % of our law (rms), or where
a parameter is named.
"""

from __future__ import annotations

import argparse
import json
import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._adapter_flaws import (
    ALIKE,
    CONTROLS,
    LAYOUT,
    AdapterFlaw,
    Parameters,
    Runs,
    Simulation,
    drawn_plan,
)
from benchmarks._simulated_flaws import FLAWS, Block, Flaw, Given, simulated
from benchmarks._simulated_scores import figures_of, print_cases
from benchmarks.timing import table
from palpate.diagnosis.options import AttributionOptions, DiagnoseOptions
from palpate.diagnosis.other_simulator.declared_parameters import KEYS, Stated
from palpate.diagnosis.other_simulator.forces import Forces, ForcesOptions
from palpate.diagnosis.other_simulator.pipeline import Asked, diagnose_simulated
from palpate.diagnosis.other_simulator.result import SimulatedGap
from palpate.diagnosis.pipeline import diagnose
from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.errors import OptionError
from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.result import plain
from palpate.output import progress_bar
from palpate.render.replay import rms_n
from palpate.scenes.laboratory.sealing import digest

LATE_S = 0.03


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How many cases of each kind."""
    parser.add_argument("--kept", action="store_true", help="judge nothing, count what lies in --work")
    parser.add_argument("--singles", type=int, default=39, help="cases with one flaw")
    parser.add_argument("--pairs", type=int, default=12, help="cases with two")
    parser.add_argument("--controls", type=int, default=12, help="cases with none")
    parser.add_argument(
        "--adapter",
        nargs="+",
        choices=CONTROLS,
        help="plant them in these simulators instead of in our own law's forces",
    )
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


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Plant, seal, judge, open; print what was found."""
    if arguments.adapter is not None:
        worlds = cache(lambda number: _world(Block(0, LAYOUT), number % 2 == 1, number))
        said = [_run_adapter(adapter, arguments, worlds) for adapter in arguments.adapter]
        return {key: [each for one in said for each in one[key]] for key in ("figures", "cases")}
    if arguments.kept:
        return _said(list(_kept(arguments.work).values()))
    block = Block()
    world = cache(lambda late: _world(block, late))
    drawn = np.random.default_rng(arguments.seed)
    plan = [_single(drawn, k) for k in range(arguments.singles)]
    plan += [_pair(drawn) for _ in range(arguments.pairs)] + [()] * arguments.controls
    rows = _kept(arguments.work)
    with progress_bar("cases") as tell:
        # a mixture from the first on, as a run may be ended early
        for k, number in enumerate(drawn.permutation(len(plan))):
            tell("cases", k / len(plan))
            name = f"{arguments.seed}-{number}"
            if name in rows:
                continue
            seed = 1000 * arguments.seed + int(number)
            rows[name] = _judged(block, world(number % 3 == 2), plan[number], seed)
            _keep(arguments.work, name, rows[name])
    return _said(list(rows.values()))


def _run_adapter(
    adapter: str, arguments: argparse.Namespace, worlds: Callable[[int], _Reality]
) -> dict[str, Any]:
    """The same with flaws planted in a simulator (`_adapter_flaws`), whose control comes first. worlds: by
    number, diagnosed where it is asked for; that of odd ones has a late sensor."""
    work = arguments.work
    rows = _kept(work, f"{adapter}-")
    if arguments.kept:
        return _said(list(rows.values()), f"{adapter}: ")
    runs = Runs(None if work is None else work / "runs")
    rng = np.random.default_rng(arguments.seed)
    parameters = Parameters(runs.block)
    plan = drawn_plan(adapter, rng, arguments.singles, arguments.pairs, parameters)
    gaps: dict[str, float] = {}
    cases = [((), k) for k in range(max(arguments.controls, 1))] + [(p, 0) for p in plan]
    with progress_bar("cases") as tell:
        for number, (planted, k) in enumerate(cases):
            tell("cases", number / len(cases))
            name = f"{adapter}-{arguments.seed}-{number}"
            if name not in rows:
                rows[name] = _adapter_row(runs, adapter, worlds(k), planted, gaps)
                _keep(work, name, rows[name])
            if k == 0:
                gaps[_key(planted)] = rows[name]["gap_n"]
    return _said(list(rows.values()), f"{adapter}: ")


def _key(planted: Sequence[tuple[AdapterFlaw, dict[str, float]]]) -> str:
    return json.dumps([[flaw.name, change] for flaw, change in planted])


def _adapter_row(
    runs: Runs,
    adapter: str,
    world: _Reality,
    planted: Sequence[tuple[AdapterFlaw, dict[str, float]]],
    gaps: dict[str, float],
) -> dict[str, Any]:
    """Run, seal, judge one case. gaps: N by `_key`, of what was judged in the same world before."""
    counted = world.model.presses.touching(world.recording.t)

    def given(changes: Sequence[tuple[AdapterFlaw, dict[str, float]]]) -> Simulation:
        simulation = CONTROLS[adapter]
        for _, change in changes:
            simulation = simulation.but(change)
        return simulation

    def force(changes: Sequence[tuple[AdapterFlaw, dict[str, float]]]) -> np.ndarray:
        return runs.force(adapter, given(changes))

    whole, control = force(planted), force(())
    sizes = {flaw.name: rms_n((force([(flaw, change)]) - control)[counted]) for flaw, change in planted}
    rest = _key([each for each in planted if each[0].name != _largest(sizes)])
    sealed = _sealed([[flaw.name, *change.values()] for flaw, change in planted])
    # its best settings, given what it was given
    best = force([each for each in planted if each[0].parameter is not None])
    base = Forces(runs.block.t, best, adapter) if planted else None
    verdict = _verdict(world, Forces(runs.block.t, whole, adapter), given(planted).stated, base)
    off = rms_n((control - runs.law)[counted]) / rms_n(runs.law[counted])
    right = {flaw.name: list(flaw.right) for flaw, _ in planted}
    limits = _limits(verdict)
    seen = [limits[n] for n in right.get(_largest(sizes), []) if n in limits]
    # of a parameter half the noise must be seen, whatever the force (`--smallest`)
    least = max(0.02 * rms_n(whole[counted]), min(seen or [0.5 * verdict.noise_n]))
    row = _row(world, sealed, sizes, right, verdict, least, gaps.get(rest, verdict.gap_before_n))
    wrongly = set(row["named"]) if off < ALIKE else set(verdict.parts["parameters"].names)
    return {
        **row, "right": right, "own": [*verdict.own.effects] if verdict.own else [], "own_share": off,
        "made_up": plain(verdict.made_up), "false_alarm": bool(wrongly),
    }  # fmt: skip


def _kept(folder: Path | None, start: str = "") -> dict[str, dict[str, Any]]:
    """Rows by name that lie in a folder, their seals checked."""
    if folder is None:
        return {}
    folder.mkdir(parents=True, exist_ok=True)
    rows = {path.stem: json.loads(path.read_text()) for path in sorted(folder.glob(f"{start}*.json"))}
    _check_seals(list(rows.values()))
    return rows


def _keep(folder: Path | None, name: str, row: dict[str, Any]) -> None:
    if folder is not None:
        (folder / f"{name}.json").write_text(json.dumps(row, indent=1, default=float))


def _said(rows: list[dict[str, Any]], of: str = "") -> dict[str, Any]:
    """Print every case and the counts; the figures with the cases."""
    print_cases(rows)
    figures = figures_of(rows, of)
    said = [[f.what, f"{f.value:.3g} {f.unit}", f.target] for f in figures]
    print(table(["figure", "value", "target"], said))
    return {"figures": figures, "cases": rows}


def _check_seals(rows: Sequence[dict[str, Any]]) -> None:
    broken = [k for k, row in enumerate(rows) if digest(row["truth"], row["salt"]) != row["sealed"]]
    if broken:
        raise OptionError(f"cases {broken} are not what was sealed: judge them again")


def _world(block: Block, late: bool, seed: int | None = None) -> _Reality:
    force = block.force(Given(poisson=block.layout.poisson))
    if late:
        force = np.column_stack([np.interp(block.t - LATE_S, block.t, f) for f in force.T])
    recording, model = block.measured(np.random.default_rng(int(late) if seed is None else seed), force)
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
    block: Block, world: _Reality, planted: Sequence[tuple[Flaw, float]], seed: int
) -> dict[str, Any]:
    clean, _ = simulated(block, (), seed)
    force, given = simulated(block, planted, seed)
    counted = world.model.presses.touching(world.recording.t)
    sizes = {f.name: rms_n((simulated(block, [(f, x)], seed)[0] - clean)[counted]) for f, x in planted}
    largest = _largest(sizes)
    rest, _ = simulated(block, [(f, x) for f, x in planted if f.name != largest], seed)
    sealed = _sealed([[f.name, x] for f, x in planted])
    stated = Stated(given.modulus_pa, given.poisson, given.friction, given.radius_m, frozenset(KEYS))
    verdict = _verdict(world, Forces(block.t, force, "planted"), stated)
    least = 0.02 * rms_n(verdict.simulated)
    seen = max(_limits(verdict).get(largest, least), least)
    left_n = rms_n((world.recording.force_on_tool - rest)[counted])
    return _row(world, sealed, sizes, {f.name: [f.name] for f, _ in planted}, verdict, seen, left_n)


def _largest(sizes: Mapping[str, float]) -> str:
    """The flaw that changes the force most; '' for none."""
    return max(sizes, key=lambda n: sizes[n], default="")


def _limits(verdict: SimulatedGap) -> dict[str, float]:
    return {e.name: e.detectable_n for e in verdict.entries if np.isfinite(e.detectable_n)}


def _sealed(flaws: list[list[Any]]) -> dict[str, Any]:
    truth, salt = {"flaws": flaws}, secrets.token_hex(16)
    return {"truth": truth, "salt": salt, "sealed": digest(truth, salt)}


def _row(
    world: _Reality,
    sealed: Mapping[str, Any],
    sizes: Mapping[str, float],
    right: Mapping[str, Sequence[str]],
    verdict: SimulatedGap,
    least_n: float,
    left_n: float,
) -> dict[str, Any]:
    """sizes: by flaw the N rms by which it changes the force; right: the names that say it. least_n: what can
    be seen of the largest; left_n: the gap without it."""
    largest, named = _largest(sizes), _named(verdict)
    at = [n for n in named if n in right.get(largest, ())]
    known = {e.name: e.gap_after_n for e in verdict.entries}
    return {
        **sealed, "late_sensor": world.late, "sizes_n": sizes,
        "times_visible": sizes[largest] / least_n if largest else 0.0, "left_n": left_n,
        "kind": verdict.kind, "named": named, "candidates": list(verdict.candidates),
        "reality": list(verdict.parts["reality"].names),
        "shares": {name: part.share for name, part in verdict.parts.items()},
        "said_left_n": known.get(at[0]) if at else None, "gap_n": verdict.gap_before_n,
        "adds_up": _adds_up(verdict),
    }  # fmt: skip


def _verdict(world: _Reality, forces: Forces, stated: Stated, base: Forces | None = None) -> SimulatedGap:
    """What is said, of nothing but the forces and what the simulation was given; and of its base."""
    return diagnose_simulated(
        world.recording, world.model, Asked(forces, stated, ForcesOptions(clock_offset_s=0.0), base=base),
        DiagnoseOptions(bootstrap=100), reality=world.diagnosis, attribution=AttributionOptions(most=2),
    )  # fmt: skip


def _named(verdict: SimulatedGap) -> list[str]:
    own = {n for part in ("numerics", "parameters") for n in verdict.parts[part].names}
    return [n for n in verdict.effects if n in own]


def _adds_up(verdict: SimulatedGap) -> bool:
    whole = sum(part.share for part in verdict.parts.values()) + verdict.unexplained
    return bool(abs(whole - 1) < 1e-9)
