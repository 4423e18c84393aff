"""First touches against the flat top that an object is said to have, before anything is computed on it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from palpate.reconstruction.checks.finding import ALL_THE_SAME, OF_A_SHAPE, Finding
from palpate.reconstruction.geometry.slab import off_the_plane
from palpate.reconstruction.geometry.stated import GeometryOptions
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.steps.s3_contacts.sliding_presses import FLAT


def flat(measured: Measured, geometry: GeometryOptions) -> Iterator[Finding]:
    """Touches that lie on no plane, of an object that was said to be a slab or a half-space."""
    if geometry.kind not in FLAT:
        return
    off = off_the_plane(measured.presses, geometry)
    if off is None or not off.words:
        return
    yield Finding(
        f"no {geometry.kind}",
        off.words,
        f"{off.typical_m / off.most_m:.1f} times the most",
        "give its shape with --shape, or trace its base",
        np.inf,
        np.inf,
        ways=(*OF_A_SHAPE, ALL_THE_SAME),
    )
