"""What a picture of an indentation shows: the first curve as it was measured, and what was fitted over it.

The material of a specimen from fewer indentations than can be held out: laws of the dent, the machine.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import t as student

from palpate.diagnosis.search.fit import settings_of
from palpate.diagnosis.specimen.approach import Approach
from palpate.diagnosis.specimen.bench import Bench
from palpate.diagnosis.specimen.machine_compliance import (
    Machine,
    Way,
    machine_of,
    own_moduli,
    rigid_interval,
    way_of,
)
from palpate.diagnosis.specimen.pulled import jkr_modulus
from palpate.diagnosis.specimen.result import MachineTests, Material
from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.effects.tool_compliance import EFFECT as TOOL

Seen = tuple[np.ndarray, np.ndarray, np.ndarray, str, str]
"""Depth m, force N measured, force N of the fit, and the axes' words."""
_DRAWN = 300


def seen_of_few(bench: Bench, approach: Approach, machine: Machine | None) -> Seen:
    """The first curve, in the machine's size, and the law's over it."""
    part, like = bench.model.presses.parts[0], bench.similarity
    depth, push = bench.model.presses.depth[part] / like.length, bench.model.presses.push[part] / like.force
    law = approach.law if machine is None else machine.law
    modulus = float(approach.modulus_pa[0]) if machine is None else machine.modulus_pa
    shift = approach.first / like.length if machine is None else 0.0
    dent = np.linspace(0.0, max(float(depth.max()) - shift, 1e-12), _DRAWN)
    nu, tip = bench.model.material.poisson_ratio, bench.tip.scaled(1 / like.length)
    force = tip.force(law, dent, modulus, nu)
    gives = 0.0 if machine is None else force / machine.stiffness_n_per_m
    return depth, push, np.interp(depth, dent + gives + shift, force), "depth [m]", "force [N]"


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
_ALIKE = 1.1
"""The interval of a few curves covers laws that miss at most so many times what the best misses."""


def _both(modulus_pa: float, own: np.ndarray, interval: tuple[float, float]) -> tuple[float, float]:
    """Pa, 95 %: by what curves differ in ln E, own (c,) Pa, beside the fit's own interval."""
    between = 0.0
    if len(own) > 1:
        between = student.ppf(0.975, len(own) - 1) * np.log(own).std(ddof=1) / np.sqrt(len(own))
    return as_read(modulus_pa, interval, between)


def as_read(modulus_pa: float, interval: tuple[float, float], log_half: float = 0.0) -> tuple[float, float]:
    """Pa, 95 %, about a modulus: an interval, what else its logarithm is known by, and how truly forces and
    travels are read at all."""
    low, high = (
        float(np.sqrt(np.log(end / modulus_pa) ** 2 + log_half**2 + (2 * _READ) ** 2)) for end in interval
    )
    return modulus_pa * float(np.exp(-low)), modulus_pa * float(np.exp(high))


def _ways(tests: MachineTests, bench: Bench) -> list[Way]:
    """The ways in, in the machine's size."""
    return [
        way_of(curve.travel, curve.force, float(at))
        for curve, at, used in zip(tests.curves, bench.onset_m, bench.used, strict=True)
        if used
    ]


def material_of_few(
    tests: MachineTests, bench: Bench, approach: Approach, names: tuple[str, ...], notes: list[str]
) -> Material:
    """Fewer curves than can be held out: the laws of the dent, the machine beside them."""
    own = approach.modulus_pa
    gone = "it ends in its hold"
    if np.isfinite(approach.hysteresis):
        gone = f"{round(100 * approach.hysteresis)} % of the work does not come back"
    pull = float(approach.pull_n.max())
    if pull > 0:
        gone += f", and it pulls by up to {_force(pull)} on the way out"
    tip = tests.tip
    assert tip is not None
    ways = _ways(tests, bench)
    machine: Machine | None = None
    nu = bench.model.material.poisson_ratio
    if tip.form == "punch":
        notes.append(_STRAIGHT)
    elif len(ways) > 1 or np.isfinite(approach.hysteresis):
        machine = machine_of(ways, nu, tip, float(np.median(own)))
    lost = approach.hysteresis if approach.hysteresis > _WIDE else 0.0
    if lost:
        notes.append(_LOOP)
    limit = _ALIKE * approach.error[approach.law]
    likely = [approach.law, *(n for n in tip.laws if n != approach.law and approach.error[n] <= limit)]
    interval = _both(float(own.mean()), own, rigid_interval(ways, nu, tip, float(own.mean()), likely))
    if pull > 0 and tip.radius_m is not None and tip.form == "sphere":
        sticky = jkr_modulus(ways, tip.radius_m, nu, pull, float(own.mean()))
        ends = as_read(sticky, (sticky, sticky))
        interval = min(interval[0], ends[0]), max(interval[1], ends[1])
        notes.append(
            f"with that pull by JKR the modulus would be {sticky:.4g} Pa: the interval reaches there"
        )
    onset = {"onset_m": bench.onset_m[bench.used].tolist()}
    common = Material(
        kind="indentation",
        files=names,
        curves=len(own),
        held_out="blocks of each way in",
        young_modulus_pa=float(own.mean()),
        young_modulus_ci95_pa=_with_loop(lost, interval),
        law=approach.law,
        error=approach.error,
        verdict=f"{approach.law} follows the way in best; {gone}",
        parameters=onset,
        notes=(*notes, _NO_SPHERE if tip.form != "sphere" else _FEW if tests.timed else _NO_TIME),
        unknown=(*INDENTATION_UNKNOWN, "which effect"),
        odds=tests.odds,
        seen=seen_of_few(bench, approach, None),
    )
    if machine is None:
        return common
    low, high = machine.stiffness_ci95_n_per_m
    return replace(
        common,
        young_modulus_pa=machine.modulus_pa,
        young_modulus_ci95_pa=_with_loop(
            lost,
            _both(machine.modulus_pa, own_moduli(ways, nu, tip, machine), machine.modulus_ci95_pa),
        ),
        seen=seen_of_few(bench, approach, machine),
        law=machine.law,
        error={**approach.error, "on a rigid machine": machine.rigid_error, "verdict": machine.error},
        verdict=f"the machine yields by {machine.stiffness_n_per_m / 1e3:.3g} N/mm "
        f"({low / 1e3:.3g} to {high / 1e3:.3g}); {gone}",
        effects=(TOOL.name,),
        at_bound=(MACHINE_TAKES_ALL,) if machine.takes_all else (),
        bound_carries=machine.takes_all,
        parameters={**onset, TOOL.name: {"stiffness_n_per_m": machine.stiffness_n_per_m}},
        notes=(*common.notes, f"on a rigid machine the modulus would be {machine.rigid_modulus_pa:.4g} Pa"),
    )


def _with_loop(lost: float, interval: tuple[float, float]) -> tuple[float, float]:
    """The interval, Pa, of a modulus that a loop leaves open: it reaches down to what comes back."""
    return (1 - lost) * interval[0], interval[1]


def _force(newtons: float) -> str:
    """A force as people write it, down to nanonewtons."""
    for unit, scale in (("N", 1.0), ("mN", 1e3), ("µN", 1e6)):
        if newtons * scale >= 0.1:
            return f"{newtons * scale:.2g} {unit}"
    return f"{newtons * 1e9:.2g} nN"


INDENTATION_UNKNOWN = ("what differs from place to place", "sideways forces and friction", "Poisson's ratio")
