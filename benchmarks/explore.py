"""Guided exploration against other orders of touching: presses and seconds until the goals are met.

Sealed phantoms: objects of the pool of varied ones, modulus and noise drawn by seed, a third without any
effect, the others with one cause at 2 to 4 times the size from which it shows and matters. The robot
explores each in every order, with errors of place, depth and speed, the same goals and the same stop rule.
Told are presses and seconds until shape and modulus, and until the cause, were as sure as asked for, and what
was true then. Each exploration is kept in the work folder by its content: a run that was interrupted goes on.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._explore_phantoms import Sealed, robot_of, sealed, strengthened
from benchmarks.evidence import wilson
from benchmarks.timing import table
from palpate.diagnosis.explore.causes import NONE
from palpate.diagnosis.explore.explorer import ExplorationState, Explorer, Order
from palpate.diagnosis.explore.goals import GoalOptions
from palpate.mechanics.disk.scratch import cache_folder
from palpate.mechanics.disk.store import content_key
from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.errors import PalpateError
from palpate.mechanics.shape.nearest import distance, sample
from palpate.output import progress_bar
from palpate.scenes.laboratory.specimen import VERSION as LABORATORY

NEAR_M = 0.025
"""How far a person's next press usually is from the last."""


def spread(places: np.ndarray, touched: np.ndarray, here: np.ndarray, rng: np.random.Generator) -> int:
    """The place farthest from all that were touched."""
    away = np.linalg.norm(places[:, None] - touched[None], axis=2).min(axis=1)
    return int(np.argmax(away))


def at_random(places: np.ndarray, touched: np.ndarray, here: np.ndarray, rng: np.random.Generator) -> int:
    """Any place."""
    return int(rng.integers(len(places)))


def person(places: np.ndarray, touched: np.ndarray, here: np.ndarray, rng: np.random.Generator) -> int:
    """As people explore: mostly a neighbour of the last place, now and then somewhere else."""
    away = np.linalg.norm(places - here, axis=1)
    weight = np.exp(-((away / NEAR_M) ** 2) / 2) + 0.02
    return int(rng.choice(len(places), p=weight / weight.sum()))


ORDERS: dict[str, Order] = {"spread": spread, "person": person, "random": at_random}


VERSION = 4
"""Of what an exploration does: raised when kept ones say nothing of the program any more."""
PHANTOMS = 3
"""Of how phantoms are drawn and how strong their causes are."""
NAMES = ("guided", *ORDERS)
AT, WITHIN = 12, 0.05
"""Presses at which the modulus is held against the truth, and what counts as right."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How many phantoms, which orders, how many presses at most."""
    parser.add_argument("--count", type=int, default=60, help="phantoms (default: 60)")
    parser.add_argument("--first", type=int, default=0, help="first seed (default: 0)")
    parser.add_argument("--orders", nargs="+", choices=NAMES, default=list(NAMES), help="(default: all)")
    parser.add_argument("--most", type=int, default=20, help="presses at most (default: 20)")
    parser.add_argument("--work", type=Path, help="folder of explorations that were made")
    parser.add_argument("--only-read", action="store_true", help="tell what is there, make nothing")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Explore every phantom in every order; print medians."""
    work = arguments.work or cache_folder() / "bench-explore"
    goals = GoalOptions(most=arguments.most, cause_at=0.95)
    seeds = range(arguments.first, arguments.first + arguments.count)
    jobs = [(order, seed) for order in arguments.orders for seed in seeds]
    made: list[dict[str, Any]] = []
    with progress_bar("explorations") as bar:
        for done, (order, seed) in enumerate(jobs):
            row = kept(work, seed, order, goals, only_read=arguments.only_read)
            made += [row] if row else []
            bar("explorations", (done + 1) / len(jobs))
    print(tables(made, arguments.orders))
    return {"explorations": made}


def kept(work: Path, seed: int, order: str, goals: GoalOptions, *, only_read: bool) -> dict[str, Any] | None:
    """One exploration, read where it was made before."""
    about = {"goals": dataclasses.asdict(goals), "version": VERSION, "laboratory": LABORATORY}
    drawn = {"seed": seed, **about, "version": PHANTOMS}
    phantom = _stored(work / "phantoms", drawn, lambda: _phantom(seed), only_read)
    if phantom is None:
        return None
    if phantom["trouble"]:
        return {"seed": seed, "order": order, "trouble": phantom["trouble"]}
    it = Sealed(**phantom["sealed"])
    content = {"seed": seed, "order": order, **about}
    return _stored(work / "explorations", content, lambda: explored(it, order, goals), only_read)


def _phantom(seed: int) -> dict[str, Any]:
    try:
        return {"sealed": dataclasses.asdict(strengthened(sealed(seed))), "trouble": ""}
    except PalpateError as error:
        return {"sealed": dataclasses.asdict(sealed(seed)), "trouble": str(error)}


def _stored(
    folder: Path, content: dict[str, Any], make: Callable[[], dict[str, Any]], only_read: bool
) -> dict[str, Any] | None:
    name = "-".join(str(content[k]) for k in ("seed", "order") if k in content)
    path = folder / f"{name}-{content_key(json.dumps(content, sort_keys=True))[:12]}.json"
    if path.exists():
        return json.loads(path.read_text(encoding="utf-8"))
    if only_read:
        return None
    made = make()
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(path) as temporary:
        temporary.write_text(json.dumps(made), encoding="utf-8")
    return made


def explored(it: Sealed, order: str, goals: GoalOptions) -> dict[str, Any]:
    """One exploration, step by step. A phantom that cannot be explored is told with its trouble."""
    robot = robot_of(it)
    explorer = Explorer(
        robot.instrument,
        goals,
        poisson_ratio=robot.phantom.poisson_ratio,
        seed=it.seed,
        order=None if order == "guided" else ORDERS[order],
    )
    row: dict[str, Any] = {**dataclasses.asdict(it), "object": robot.phantom.name, "order": order}
    steps: list[dict[str, Any]] = []
    trouble, begin = "", time.process_time()
    try:
        while (suggestion := explorer.suggest()).kind != "stop":
            segment = robot.carry_out(suggestion)
            clock = time.process_time()
            state = explorer.add(segment)
            steps.append(_step(explorer, state, it, robot, time.process_time() - clock))
    except PalpateError as error:
        trouble = str(error)
    return row | {"steps": steps, "trouble": trouble, "cpu_s": time.process_time() - begin}


def _step(
    explorer: Explorer, state: ExplorationState, it: Sealed, robot: Any, update_s: float
) -> dict[str, Any]:
    """What was known after a touch, and what was true."""
    step: dict[str, Any] = {
        "made": state.made,
        "presses": state.presses,
        "seconds": state.seconds,
        "update_s": update_s,
        "met": [s.name for s in state.goals if s.met],
        "trouble": state.trouble,
    }
    surface = explorer.estimate.surface
    if surface is not None:
        low, high = state.modulus_ci95_pa
        assert explorer.estimate.fit is not None
        step["modulus_half"] = (high - low) / (2 * state.modulus_pa)
        step["plain_error"] = explorer.estimate.fit.modulus_pa / it.young_modulus_pa - 1
        step["modulus_error"] = state.modulus_pa / it.young_modulus_pa - 1
        step["covered"] = bool(low <= it.young_modulus_pa <= high)
        step["surface_m"] = _off(surface, robot) if {"surface"} <= set(step["met"]) else None
    if state.causes is not None:
        step["standing"] = state.causes.not_ruled_out(state.cause_at)
        step["ratio"] = {k: v for k, v in state.causes.ratio.items() if v > 1e-4}
        step["misfit"] = state.causes.misfit
    return step


def _off(surface: Any, robot: Any) -> float:
    """m, within which 95 % of the surface lies of the phantom's."""
    points = sample(surface.vertices, surface.triangles, 1500)
    points = points[points[:, 2] > 1e-3]
    return float(np.percentile(distance(robot.phantom.vertices, robot.phantom.faces, points), 95))


def first_at(row: dict[str, Any], good: Callable[[dict[str, Any]], bool]) -> dict[str, Any] | None:
    """The first step at which `good` holds."""
    return next((s for s in row["steps"] if good(s)), None)


def shape_and_modulus(step: dict[str, Any]) -> bool:
    """Both goals met, by the explorer's own word."""
    return {"modulus", "surface"} <= set(step["met"])


def alone(step: dict[str, Any]) -> bool:
    """One cause, or none, left by itself."""
    return len(step.get("standing", [])) == 1


def by_truth(own: list[dict[str, Any]]) -> list[Any]:
    """Of one order: the modulus after AT presses, or where the exploration ended before."""
    last = [
        steps[-1]
        for m in own
        if (steps := [s for s in m["steps"] if "modulus_half" in s and s["made"] <= AT])
    ]
    off = [abs(s["modulus_error"]) for s in last]
    return [
        len(last), 100 * _middle(off), 100 * _share([x <= WITHIN for x in off]),
        100 * _middle([abs(s["plain_error"]) for s in last]),
        100 * _middle([s["modulus_half"] for s in last]),
        100 * _share([s["covered"] for s in last]),
    ]  # fmt: skip


def tables(made: list[dict[str, Any]], orders: list[str]) -> str:
    """All tables: shape and modulus by their own word; causes; the modulus by the truth."""
    shape, cause, truth = [], [], []
    for order in orders:
        own = [m for m in made if m["order"] == order and m.get("steps")]
        if not own:
            continue
        met = [s for m in own if (s := first_at(m, shape_and_modulus))]
        shape.append([
            order, len(own), len(met), _median([s["made"] for s in met], len(own)),
            _median([s["seconds"] for s in met], len(own)),
            _middle([100 * abs(s["modulus_error"]) for s in met]),
            f"{sum(s['covered'] for s in met)}/{len(met)}",
            _middle([1e3 * s["surface_m"] for s in met if s["surface_m"] is not None]),
            _middle([s["update_s"] for m in own for s in m["steps"] if s["presses"] >= 5]),
        ])  # fmt: skip
        truth.append([order, *by_truth(own)])
        there = [m for m in own if m["cause"]]
        told = [(m, s) for m in there if (s := first_at(m, alone))]
        right = [s for m, s in told if s["standing"] == [m["cause"]]]
        none = [m for m in own if not m["cause"]]
        alarms = sum(any(NONE not in s.get("standing", [NONE]) for s in m["steps"]) for m in none)
        lost = sum(any(m["cause"] not in s.get("standing", [m["cause"]]) for s in m["steps"]) for m in there)
        _, low, high = wilson(alarms, len(none)) if none else (0.0, 0.0, 1.0)
        cause.append([
            order, len(there), len(right), len(told) - len(right), lost,
            _median([s["made"] for s in right], len(there)),
            _median([s["seconds"] for s in right], len(there)),
            f"{alarms}/{len(none)} ({100 * low:.0f} to {100 * high:.0f} %)",
        ])  # fmt: skip
    heads = ["order", "phantoms", "goals met", "presses, median", "seconds", "modulus error [%]",
             "covered", "95 % of surface within [mm]", "update, median [CPU s]"]  # fmt: skip
    more = ["order", "with a cause", "right one alone", "wrong one alone", "true one ever out",
            "presses, median", "seconds", "'none' ever out where it is true"]  # fmt: skip
    so = ["order", "phantoms", f"modulus error after {AT} [%]", f"within {100 * WITHIN:g} % [%]",
          "without causes [%]", "half the interval [%]", "covered [%]"]  # fmt: skip
    troubles = [f"seed {m['seed']}, {m['order']}: {m['trouble']}" for m in made if m["trouble"]]
    return "\n".join([table(heads, shape), "", table(more, cause), "", table(so, truth), *troubles])


def _median(values: list[float], of: int) -> str:
    """Median over all `of` explorations, those that did not get there counting as worst."""
    ranked = sorted(values) + [np.inf] * (of - len(values))
    if not ranked:
        return "-"
    middle = 0.5 * (ranked[(of - 1) // 2] + ranked[of // 2])
    return f"{middle:.0f}" if np.isfinite(middle) else "not reached"


def _share(values: list[bool]) -> float:
    return sum(values) / len(values) if values else float("nan")


def _middle(values: list[float]) -> float:
    return float(np.median(values)) if values else float("nan")
