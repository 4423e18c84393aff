"""Strain stiffening: the dent's force grows faster with depth than neo-Hookean (Yeoh's second
coefficient)."""

from __future__ import annotations

from mechanics.dent import DentLaw, grid

FORCE_PER_C20 = 0.55
"""Share by which the dent's force grows a unit of c20 / c10 at an indentation of one tip radius."""


def stiffened(law: DentLaw, c20_over_c10: float) -> DentLaw:
    """The dent law times 1 + 0.55 c20/c10 delta/R: the squared strain under a sphere goes with its depth."""
    return law.scaled(1 + FORCE_PER_C20 * c20_over_c10 * grid(), name=f"{law.name}, stiffening")
