"""First guesses of every shape for given evidence."""

from __future__ import annotations

import numpy as np

from mechanics.errors import SurfaceError
from reconstruct.shapes.base import Shape
from reconstruct.shapes.cap import Cap
from reconstruct.shapes.cushion import Cushion
from reconstruct.shapes.dome import Dome
from reconstruct.shapes.evidence import Evidence
from reconstruct.shapes.fit import Seen
from reconstruct.shapes.outline import circle, polygon, seeing_centre, smooth_curve
from reconstruct.shapes.prism import Prism

FITTED = ("cylinder", "block", "extrusion", "sphere", "ellipsoid", "dome", "cushion")
"""Shapes with parameters, as `--surface` spells them."""


def first_guesses(evidence: Evidence, seen: Seen) -> list[Shape]:
    """One or more starts of each shape that the outline allows.

    Raises SurfaceError where no point sees the whole outline.
    """
    rim = evidence.to_support(evidence.outline)[:, :2]
    outward = evidence.to_support(evidence.outline_centres)[:, :2] - rim
    centre, cosine = seeing_centre(rim, outward / max(evidence.tip_radius_m, 1e-9))
    if cosine <= 0:
        raise SurfaceError("no point sees the whole base outline: use --surface implicit")
    curve = smooth_curve(rim, centre)
    straight, round_ = polygon(curve, rim), circle(rim)
    height = float(seen.centres[:, 2].max() - seen.tip_radius_m)
    if not height > 0.001:
        raise SurfaceError("every touch is on the support: touch the object above its base")
    radius = float(np.linalg.norm(round_.vertices[0] - round_.centre))
    found: list[Shape] = []
    for outline in (round_, straight, curve):
        if outline is not None:
            found.append(Prism.of(outline, height, sloped=False, drafted=False))
            found.append(Prism.of(outline, height, sloped=True, drafted=True))
    found.append(Cap.sphere(np.array([*round_.centre, height - radius]), radius))
    long, short, turn = _extent(curve.vertices)
    found.append(Cap.ellipsoid(np.array([*round_.centre, 0.0]), np.array([long, short, height]), turn))
    found += [Dome.of(curve, height, exponent) for exponent in (2.0, 5.0)]
    found.append(Cushion.of(curve if straight is None else straight, height, 0.01))
    return found


def _extent(vertices: np.ndarray) -> tuple[float, float, float]:
    """Half lengths along the principal axes of points (n, 2), and the angle of the longer."""
    offset = vertices - vertices.mean(axis=0)
    axes = np.linalg.svd(offset, full_matrices=False)[2]
    half = np.ptp(offset @ axes.T, axis=0) / 2
    return float(half[0]), float(half[1]), float(np.arctan2(axes[0, 1], axes[0, 0]))
