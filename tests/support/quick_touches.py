"""Varied explorations in seconds: the laboratory's hand, instrument and shapes, touches in closed form.

The laboratory solves ten minutes of solid mechanics an object. What a check-up reads off a recording (clock,
channels, units, directions) needs no such truth: Hertz along the normal, Mindlin's stiffness across it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.varied.draws import draw
from benchmarks.varied.recorded import record
from palpate.mechanics.recording.recording import Recording
from palpate.scenes.laboratory.curves import Curve, PathJob
from palpate.scenes.laboratory.specimen import Specimen
from palpate.scenes.phantoms import Phantom


def varied(seed: int, folder: Path) -> Recording:
    """The `seed`-th exploration of the variety, its files in `folder`; touches in closed form."""
    with patch("palpate.scenes.laboratory.paths.curves", _curves):
        return record(draw(seed), folder).recording


def _curves(phantom: Phantom, specimen: Specimen, jobs: Sequence[PathJob], *_: Any) -> list[Curve]:
    return [_curve(specimen, job) for job in jobs]


def _curve(specimen: Specimen, job: PathJob) -> Curve:
    """Hertz, F = 4/3 E / (1 - nu^2) sqrt(R) d^1.5, and Mindlin, k_t = 2 (1 - nu) / (2 - nu) dF/dd."""
    nu, normal = specimen.poisson_ratio, job.normal
    depth = np.maximum(-job.travel @ normal, 0.0)
    hertz = 4 / 3 / (1 - nu**2) * np.sqrt(specimen.tip_radius)
    push = hertz * depth**1.5
    stiff = 1.5 * hertz * np.sqrt(depth)
    across = job.travel - np.outer(job.travel @ normal, normal)
    share = 2 * (1 - nu) / (2 - nu)
    # what sticks grows with each step, and shrinks with the circle that holds it on the way out
    drag = np.zeros_like(across)
    for i in range(1, len(drag)):
        kept = min(1.0, np.sqrt(depth[i] / depth[i - 1])) if depth[i - 1] > 0 else 0.0
        step = across[i] - across[i - 1]
        drag[i] = kept * drag[i - 1] - share * 0.5 * (stiff[i] + stiff[i - 1]) * step
    along = np.outer(normal, normal)
    stiffness = -stiff[:, None, None] * (along + share * (np.eye(3) - along))
    return Curve(job.travel, push[:, None] * normal + drag, stiffness, np.zeros(len(depth)))
