"""What a picture of an indentation shows: the first curve as it was measured, and what was fitted over it."""

from __future__ import annotations

import numpy as np

from palpate.diagnosis.search.fit import settings_of
from palpate.diagnosis.specimen.approach import Approach
from palpate.diagnosis.specimen.bench import HAND_TIP_M, Bench
from palpate.diagnosis.specimen.yielding import Machine
from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.contact.dent import dent_law

Seen = tuple[np.ndarray, np.ndarray, np.ndarray, str, str]
"""Depth m, force N measured, force N of the fit, and the axes' words."""
_DRAWN = 300


def seen_of_few(bench: Bench, approach: Approach, machine: Machine | None) -> Seen:
    """The first curve, in the machine's size, and the law's over it."""
    part, like = bench.model.presses.parts[0], bench.similarity
    depth, push = bench.model.presses.depth[part] / like.length, bench.model.presses.push[part] / like.force
    law = dent_law(approach.law if machine is None else machine.law)
    modulus = float(approach.modulus_pa[0]) if machine is None else machine.modulus_pa
    shift = approach.first / like.length if machine is None else 0.0
    dent = np.linspace(0.0, max(float(depth.max()) - shift, 1e-12), _DRAWN)
    radius = HAND_TIP_M / like.length
    force = np.asarray(law.force(dent, modulus, bench.model.material.poisson_ratio, radius))
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
