"""Guided exploration against other orders of touching: presses and seconds until the goals are met.

Each phantom of the pool of varied objects (scenes.variety) is explored by the laboratory's robot, with a
modulus, noise and errors of its own drawn by its seed, by every order with the same stop rule. Told are
presses and seconds of exploring, and what was true when it stopped: error of the modulus, whether the
interval covers it, and how far 95 % of the surface really is from the phantom's. Touches that were solved
before are read.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from mechanics.errors import PalpateError
from mechanics.nearest import distance, sample
from palpate.arguments import progress_bar
from palpate.benchmarks.timing import table
from palpate.exploring.explorer import Explorer
from palpate.exploring.goals import GoalOptions
from palpate.exploring.orders import ORDERS
from palpate.exploring.robot import LaboratoryRobot
from scenes.laboratory.session import SimulateOptions
from scenes.variety.draws import draw
from scenes.variety.objects import thing

SUMMARY = "guided exploration against other orders: presses and seconds until the goals are met"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How many phantoms, which orders, how many presses at most."""
    parser.add_argument("--count", type=int, default=60, help="phantoms (default: 60)")
    parser.add_argument("--first", type=int, default=0, help="first seed (default: 0)")
    parser.add_argument(
        "--orders", nargs="+", choices=("guided", *ORDERS), default=["guided", *ORDERS], help="(default: all)"
    )
    parser.add_argument("--most", type=int, default=30, help="presses at most (default: 30)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Explore every phantom in every order; print medians."""
    made: list[dict[str, Any]] = []
    jobs = [
        (s, o) for s in range(arguments.first, arguments.first + arguments.count) for o in arguments.orders
    ]
    with progress_bar("explorations") as bar:
        for done, (seed, order) in enumerate(jobs):
            made.append(explored(seed, order, arguments.most))
            bar("explorations", (done + 1) / len(jobs))
    rows = []
    for order in arguments.orders:
        own = [m for m in made if m["order"] == order and not m["trouble"]]
        if not own:
            rows.append([order, 0, *[""] * 8])
            continue
        met = [m for m in own if m["met"]]
        presses, seconds = ([m[k] for m in own] for k in ("presses", "seconds"))
        rows.append([
            order, len(own), f"{len(met)}", float(np.median(presses)), f"{min(presses)} to {max(presses)}",
            float(np.median(seconds)), 100 * float(np.median([abs(m["modulus_error"]) for m in own])),
            f"{sum(m['covered'] for m in own)}", 1e3 * float(np.median([m["surface_m"] for m in own])),
            float(np.median([m["update_s"] for m in own])),
        ])  # fmt: skip
    heads = ["order", "explorations", "goals met", "presses, median", "least to most", "seconds of exploring",
             "modulus error [%]", "covered", "95 % of surface within [mm]", "update, median [s]"]  # fmt: skip
    print(table(heads, rows))
    for m in made:
        if m["trouble"]:
            print(f"seed {m['seed']}, {m['order']}: {m['trouble']}")
    return {"explorations": made}


def explored(seed: int, order: str, most: int) -> dict[str, Any]:
    """One exploration. A phantom that cannot be explored is told with its trouble."""
    drawn = draw(seed)
    object_ = thing(drawn.number)
    phantom = object_.phantom
    options = SimulateOptions(
        young_modulus_pa=drawn.young_modulus_pa,
        tip_radius_m=object_.tip_radius_m,
        force_noise_std_n=drawn.noise_n,
    )
    robot = LaboratoryRobot(phantom, seed=seed, options=options)
    explorer = Explorer(
        robot.instrument,
        GoalOptions(most=most),
        poisson_ratio=phantom.poisson_ratio,
        seed=seed,
        order=None if order == "guided" else ORDERS[order],
    )
    updates: list[float] = []
    row: dict[str, Any] = {"seed": seed, "object": phantom.name, "order": order, "trouble": ""}
    try:
        while (suggestion := explorer.suggest()).kind != "stop":
            state = explorer.add(robot.carry_out(suggestion))
            updates.append(sum(state.update_s.values()))
    except PalpateError as error:
        return row | {"trouble": str(error)}
    state, surface = explorer.state, explorer.estimate.surface
    if surface is None:
        return row | {"trouble": state.trouble or "no surface"}
    true = (phantom.vertices, phantom.faces)
    points = sample(surface.vertices, surface.triangles, 3000)
    points = points[points[:, 2] > 1e-3]
    off = distance(*true, points)
    low, high = state.modulus_ci95_pa
    return row | {
        "met": state.done,
        "presses": state.made,
        "seconds": state.seconds,
        "modulus_error": state.modulus_pa / drawn.young_modulus_pa - 1,
        "covered": bool(low <= drawn.young_modulus_pa <= high),
        "surface_m": float(np.percentile(off, 95)),
        "update_s": float(np.median([u for u in updates if u > 0] or [0.0])),
    }
