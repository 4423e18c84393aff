"""Tissue that is not one modulus: ln E is a random smooth field, in half of all cases with layers as well.

Everything but how much it varies is drawn: how far places are alike, and how thick and stiff the layers are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from palpate.scenes.laboratory.effects.base import EffectContext, SimulatedEffect
from palpate.scenes.laboratory.field import Field

LOG_SD = 0.35
"""Standard deviation of ln E of strength 1: nine places in ten within a factor of 1.8 of the median."""
WAVES = 40
LENGTHS = (0.12, 0.5)
"""Of the object's width, over which places are alike (the waves' Gaussian correlation)."""
LAYER_MM = (3.0, 9.0)
PASSING_MM = 1.5


def _drawn(strength: float, bench: EffectContext) -> dict[str, Any]:
    rng = bench.rng
    width = 1e3 * float(np.ptp(bench.phantom.vertices, axis=0)[:2].min())
    length = width * float(np.exp(rng.uniform(*np.log(LENGTHS))))
    vectors = rng.normal(0.0, 1 / length, (WAVES, 3))
    phases = rng.uniform(0, 2 * np.pi, WAVES)
    layered = bool(rng.uniform() < 0.5)
    sd = LOG_SD * strength * (0.7 if layered else 1.0)
    amplitude = sd * np.sqrt(2 / WAVES)
    waves = [
        [round(float(v), 6) for v in (amplitude, *vector, phase)]
        for vector, phase in zip(vectors, phases, strict=True)
    ]
    count = int(rng.integers(2, 4)) if layered else 0
    layers = [
        [round(float(rng.uniform(*LAYER_MM)), 3), round(float(rng.normal(0, LOG_SD * strength)), 4)]
        for _ in range(count)
    ]
    return {"log_sd": sd, "length_m": round(1e-3 * length, 6), "waves": waves, "layers": layers}


def field_of(keys: Mapping[str, Any]) -> Field:
    """The field that these keys say; lengths mm."""
    waves = tuple(tuple(float(v) for v in wave) for wave in keys["waves"])
    layers = tuple((float(t), float(level)) for t, level in keys["layers"])
    return waves, layers, PASSING_MM


EFFECTS = (SimulatedEffect("stiffness_field", "object", _drawn, lambda s, p: replace(s, field=field_of(p))),)
