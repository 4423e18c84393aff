"""First guesses of every shape for given evidence."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.errors import SurfaceError
from palpate.reconstruction.shapes.cap import Cap
from palpate.reconstruction.shapes.crown import Crown
from palpate.reconstruction.shapes.cushion import Cushion
from palpate.reconstruction.shapes.dish import Dish
from palpate.reconstruction.shapes.dome import Dome
from palpate.reconstruction.shapes.evidence import Evidence
from palpate.reconstruction.shapes.fit import Seen
from palpate.reconstruction.shapes.outline import Outline, circle, polygon, seeing_centre, smooth_curve
from palpate.reconstruction.shapes.polyhedron import Polyhedron
from palpate.reconstruction.shapes.prism import Prism
from palpate.reconstruction.shapes.shape import Shape

FITTED = (
    "cylinder",
    "block",
    "extrusion",
    "sphere",
    "ellipsoid",
    "dome",
    "cushion",
    "crown",
    "polyhedron",
    "dish",
)
"""Shapes with parameters, as `--surface` spells them."""

_ROUND_M = 0.0015
"""A rim further from a circle than this, as a standard deviation, carries no round shape."""


class HiddenOutlineError(SurfaceError):
    """No point of the base sees its whole outline, so that the fitted shapes cannot be drawn."""


def first_guesses(evidence: Evidence, seen: Seen) -> list[Shape]:
    """One or more starts of each shape that the outline allows.

    Raises HiddenOutlineError where no point sees the whole outline, SurfaceError where nothing stands on it.
    """
    rim = evidence.to_support(evidence.outline)[:, :2]
    outward = evidence.to_support(evidence.outline_centres)[:, :2] - rim
    centre, cosine = seeing_centre(rim, outward / max(evidence.tip_radius_m, 1e-9))
    if cosine <= 0:
        raise HiddenOutlineError("no point sees the whole base outline: use --surface implicit")
    curve = smooth_curve(rim, centre)
    straight, round_ = polygon(curve, rim), circle(rim)
    height = float(seen.centres[:, 2].max() - seen.tip_radius_m)
    if not height > 0.001:
        raise SurfaceError("every touch is on the support: touch the object above its base")
    radius = float(np.linalg.norm(round_.vertices[0] - round_.centre))
    outlines = [outline for outline in (straight, curve) if outline is not None]
    found: list[Shape] = []
    if np.std(round_.distance(rim)) < _ROUND_M:
        outlines.insert(0, round_)
        found.append(Cap.sphere(np.array([*round_.centre, height - radius]), radius))
    for outline in outlines:
        found.append(Prism.of(outline, height, sloped=False, drafted=False))
        found.append(Prism.of(outline, height, sloped=False, drafted=True))
        found.append(Prism.of(outline, height, sloped=True, drafted=True))
    if straight is None:
        long, short, turn = _extent(curve.vertices)
        found.append(Cap.ellipsoid(np.array([*round_.centre, 0.0]), np.array([long, short, height]), turn))
    found += [Dome.of(curve, height, exponent) for exponent in (2.0, 5.0)]
    found.append(Cushion.of(curve if straight is None else straight, height, 0.01))
    found += [Crown.of(outline, height) for outline in outlines]
    if straight is not None:
        faces = Polyhedron.of(straight, seen.centres, seen.normals, seen.tip_radius_m)
        found += [] if faces is None else [faces]
    return found + _dishes(seen, outlines)


def _dishes(seen: Seen, outlines: list[Outline]) -> list[Shape]:
    """Dished prisms, where a touch that faces up lies lower than the highest touch."""
    feet = seen.centres - seen.tip_radius_m * seen.normals
    widest = abs(float(outlines[0].distance(outlines[0].centre[None])[0]))
    inner = outlines[0].distance(feet[:, :2]) < -0.3 * widest
    top = inner & (seen.normals[:, 2] > 0.5)
    if not top.any() or feet[top, 2].min() > feet[:, 2].max() - 0.004:
        return []
    places = np.array([seen.centres[seen.sites == k].mean(axis=0) for k in np.unique(seen.sites)])
    spacing = float(np.median(cKDTree(places).query(places, k=2)[0][:, 1])) if len(places) > 2 else 0.02
    bottom = feet[top][np.argmin(feet[top, 2])]
    highest = int(np.argmax(feet[:, 2]))
    # a level place that high is on the rim itself; else hands keep half a spacing away from it, on a wall
    # that slopes
    height = feet[highest, 2] + (0.0 if seen.normals[highest, 2] > 0.94 else 0.35 * spacing)
    return [Dish.of(outline, float(height), bottom) for outline in outlines]


def _extent(vertices: np.ndarray) -> tuple[float, float, float]:
    """Half lengths along the principal axes of points (n, 2), and the angle of the longer."""
    offset = vertices - vertices.mean(axis=0)
    axes = np.linalg.svd(offset, full_matrices=False)[2]
    half = np.ptp(offset @ axes.T, axis=0) / 2
    return float(half[0]), float(half[1]), float(np.arctan2(axes[0, 1], axes[0, 0]))
