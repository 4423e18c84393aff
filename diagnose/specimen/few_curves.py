"""What a picture of an indentation shows: the first curve as it was measured, and what was fitted over it.

The material of a specimen from fewer indentations than can be held out: laws of the dent, the machine.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.diagnosis.search.fit import settings_of
from palpate.diagnosis.specimen.approach import Approach
from palpate.diagnosis.specimen.bench import Bench
from palpate.diagnosis.specimen.elastic_fit import NAMED, Elastic
from palpate.diagnosis.specimen.result import MachineTests, Material
from palpate.diagnosis.specimen.way_in import JKR
from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.effects.tool_compliance import EFFECT as TOOL

Seen = tuple[np.ndarray, np.ndarray, np.ndarray, str, str]
"""Depth m, force N measured, force N of the fit, and the axes' words."""


def seen_of_few(bench: Bench, elastic: Elastic) -> Seen:
    """The first curve, in the machine's size, and the likeliest hypothesis over it."""
    part, like = bench.model.presses.parts[0], bench.similarity
    depth, push = bench.model.presses.depth[part] / like.length, bench.model.presses.push[part] / like.force
    force = np.interp(depth - elastic.touch_m, elastic.along_m, elastic.along_n)
    return depth, push, np.where(depth > elastic.touch_m, force, 0.0), "depth [m]", "force [N]"


def seen_of_all(bench: Bench, made: Diagnosis) -> Seen:
    """The first curve, in the machine's size, and what was found over it."""
    assert made.forward is not None and made.attribution is not None
    t, like, fit = made.forward.touches, bench.similarity, made.attribution.final.found
    push = made.forward.predict(settings_of(made.forward, fit.effects, fit.values, fit.onset))[:, 0]
    rows = t.press == 0
    depth, force = t.travel[rows, 0] / like.length, t.local_force[rows, 0] / like.force
    return depth, force, push[rows] / like.force, "depth [m]", "force [N]"


_WIDE = 0.1
"""Share of the work that may stay away in a solid whose modulus is one number."""
_LOOP = (
    "a loop so wide, or a force that fades while the tip rests, is creep, a late force or play: press more "
    "slowly and hold to separate them; a slow press may be as much softer as the interval says"
)
_FADES = 0.05
"""Share of the force that may be gone at the end of a rest in a sample whose ways in are elastic."""
_MOST_LOST = 0.9
"""Share of the work by which a loop moves the modulus, at most."""
_READ = 0.01
"""Standard deviation of ln E that no curve tells of: how true a load cell, a travel and a tip are."""
_FEW = "fewer than 6 curves: none can be held out, so no effect of the material is named"
_NO_TIME = "without a time no curve is held out, and no effect of the material is named"
_NO_SPHERE = "effects of the material are searched for under a sphere alone"
_STRAIGHT = (
    "under a flat punch a machine that yields is as straight as the material: the modulus is that of both "
    "together, too low where the machine is not far stiffer than the contact"
)
MACHINE_TAKES_ALL = "the machine's stiffness, which takes nearly all of the travel,"
"""What a modulus that is the machine's is said to rest on."""


def as_read(modulus_pa: float, interval: tuple[float, float]) -> tuple[float, float]:
    """Pa, 95 %, about a modulus: an interval, and how truly forces and travels are read at all."""
    low, high = (float(np.sqrt(np.log(end / modulus_pa) ** 2 + (2 * _READ) ** 2)) for end in interval)
    return modulus_pa * float(np.exp(-low)), modulus_pa * float(np.exp(high))


def material_of_few(
    tests: MachineTests,
    bench: Bench,
    approach: Approach,
    elastic: Elastic,
    names: tuple[str, ...],
    notes: list[str],
) -> Material:
    """Fewer curves than can be held out: laws of the dent, machine and free air, each by its likelihood."""
    gone = "it ends in its hold"
    if np.isfinite(approach.hysteresis):
        gone = f"{round(100 * approach.hysteresis)} % of the work does not come back"
    pull = float(approach.pull_n.max())
    if pull > 0:
        gone += f", and it pulls by up to {_force(pull)} on the way out"
    tip = tests.tip
    assert tip is not None
    if tip.form == "punch":
        notes.append(_STRAIGHT)
    loop = approach.hysteresis if approach.hysteresis > _WIDE else 0.0
    lost = max(loop, approach.fades if approach.fades > _FADES else 0.0)
    creeps = lost > 0
    if creeps:
        notes.append(_LOOP)
    modulus = elastic.modulus_pa
    made = Material(
        kind="indentation",
        files=names,
        curves=int(bench.used.sum()),
        held_out="blocks of each way in",
        young_modulus_pa=modulus,
        young_modulus_ci95_pa=_with_loop(lost, as_read(modulus, elastic.interval_pa)),
        law=elastic.law,
        error={**approach.error, elastic.law: elastic.missed},
        verdict=f"{elastic.law} follows the way in best; {gone}",
        parameters={"onset_m": bench.onset_m[bench.used].tolist()},
        notes=(*notes, *elastic_notes(elastic, creeps)),
        unknown=(*INDENTATION_UNKNOWN, "which effect"),
        odds=tests.odds,
        seen=seen_of_few(bench, elastic),
    )
    made = made if creeps else with_machine(made, elastic)
    more = _NO_SPHERE if tip.form != "sphere" else _FEW if tests.timed else _NO_TIME
    return replace(made, notes=(*made.notes, more))


def elastic_notes(elastic: Elastic, creeps: bool = False) -> tuple[str, ...]:
    """What else the ways in may be, and where the modulus would be then. creeps: what yields with time may be
    the sample, so a machine that does is not named."""
    notes = []
    sticky = elastic.laws.get(JKR, 0.0)
    if sticky > 1 - NAMED:
        share = f"{100 * sticky:.3g} %"
        notes.append(f"the sample pulls at the tip as by JKR (probability {share}), which the modulus counts")
    if 1 - NAMED < elastic.yields <= (1.0 if creeps else NAMED):
        notes.append(
            f"a machine that yields by {elastic.stiffness_n_per_m / 1e3:.3g} N/mm may be in it (probability "
            f"{100 * elastic.yields:.3g} %{', of an elastic sample' * creeps}): the modulus would be "
            f"{elastic.yielding_pa:.4g} Pa by it and {elastic.rigid_pa:.4g} Pa without, and the interval "
            "reaches there; press something rigid to know it"
        )
    return tuple(notes)


def with_machine(made: Material, elastic: Elastic) -> Material:
    """With the machine that yields, where it is named."""
    if not elastic.machine:
        return made
    low, high = elastic.stiffness_ci95_n_per_m
    yields = f"the machine yields by {elastic.stiffness_n_per_m / 1e3:.3g} N/mm ({low / 1e3:.3g} to "
    other = made.verdict.removeprefix(f"{made.law} follows the way in best; ")
    return replace(
        made,
        error={**made.error, "on a rigid machine": elastic.rigid_missed, "verdict": elastic.missed},
        verdict=f"{yields}{high / 1e3:.3g}); {other}",
        effects=(TOOL.name, *made.effects),
        at_bound=(*made.at_bound, *((MACHINE_TAKES_ALL,) if elastic.takes_all else ())),
        bound_carries=made.bound_carries or elastic.takes_all,
        parameters={**made.parameters, TOOL.name: {"stiffness_n_per_m": elastic.stiffness_n_per_m}},
        notes=(*made.notes, f"on a rigid machine the modulus would be {elastic.rigid_pa:.4g} Pa"),
    )


def _with_loop(lost: float, interval: tuple[float, float]) -> tuple[float, float]:
    """The interval, Pa, of a modulus that a loop leaves open: it reaches down to what comes back. Where more
    than all is lost, a tip that sticks is pulled off, which no modulus explains."""
    return (1 - min(lost, _MOST_LOST)) * interval[0], interval[1]


def _force(newtons: float) -> str:
    """A force as people write it, down to nanonewtons."""
    for unit, scale in (("N", 1.0), ("mN", 1e3), ("µN", 1e6)):
        if newtons * scale >= 0.1:
            return f"{newtons * scale:.2g} {unit}"
    return f"{newtons * 1e9:.2g} nN"


INDENTATION_UNKNOWN = ("what differs from place to place", "sideways forces and friction", "Poisson's ratio")
