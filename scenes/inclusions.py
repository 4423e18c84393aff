"""Stiff balls inside an object, as a material states them."""

from __future__ import annotations

from mechanics.material import Ball
from scenes.phantoms import Region


def ball_of(region: Region) -> Ball:
    """The region as a part of a material; its centre in the mesh's frame."""
    return Ball(region.centre_m, region.radius_m, region.modulus_ratio)
