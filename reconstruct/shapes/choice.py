"""First guesses of every shape for given evidence.

Which shape is the most likely: each is fitted and scored by the touches at places left out.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.errors import SurfaceError
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.nearest import distance
from palpate.reconstruction.shapes.cap import Cap, Cushion, Dome
from palpate.reconstruction.shapes.drawing import draw
from palpate.reconstruction.shapes.fit import Evidence, ShapeEvidence, fit
from palpate.reconstruction.shapes.kriging import Explained, explain
from palpate.reconstruction.shapes.outline import Outline, circle, polygon, seeing_centre, smooth_curve
from palpate.reconstruction.shapes.polyhedron import Polyhedron
from palpate.reconstruction.shapes.prism import Crown, Dish, Prism
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


def first_guesses(evidence: Evidence, seen: ShapeEvidence) -> list[Shape]:
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


def _dishes(seen: ShapeEvidence, outlines: list[Outline]) -> list[Shape]:
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


_CORRECTED = 6
"""So many of the best shapes are tried with a free residual field as well."""

_DIRECTION_RAD, _LEAST_LIKELY = np.radians(15.0), 3.0
"""Standard deviation of a first force's direction; what a place can cost at most, for a slip is no proof."""

_BELOW_M = 1e-4
"""No surface reaches this far below the support it stands on."""

Drawn = tuple[np.ndarray, np.ndarray, np.ndarray]


def try_shapes(evidence: Evidence, which: str = "auto", progress: Progress = silent) -> list[Explained]:
    """Every shape (or those named `which`), fitted, without and with a free residual field."""
    seen = ShapeEvidence.of(evidence)
    guesses = [g for g in first_guesses(evidence, seen) if which in ("auto", g.name)]
    if not guesses:
        raise SurfaceError(f"the base outline does not allow a {which}: use --surface auto")
    tried = []
    for k, guess in enumerate(guesses):
        tried.append(explain(*fit(guess, seen), seen, free=False))
        progress("surface", (k + 1) / (len(guesses) + 3))
    for plain in sorted(tried, key=score)[-_CORRECTED:]:
        free = explain(plain.shape, plain.lean_m, seen, free=True)
        # a free field follows systematic errors of the touches as well: it must predict places it has not
        # seen
        if held_out_error(free) < held_out_error(plain):
            tried.append(free)
    return tried


def held_out_error(explained: Explained) -> float:
    """Root mean square error (m) of touches at held-out places."""
    return float(np.sqrt(np.mean(explained.held_out[0] ** 2)))


def score(explained: Explained) -> float:
    """Log density of the held-out places and of the forces' directions, less one for each of its
    assumptions."""
    return float(explained.held_out[1].sum()) + direction_score(explained) - explained.complexity


def direction_score(explained: Explained) -> float:
    """Log density, place by place, of the first forces' directions about the normals of the shape.

    They are wrong by some 6 degrees, so they place no surface; but a wall touched near its rim pushes
    sideways, where a shape whose top ends below that touch would have the tip on its edge and push upwards.
    """
    seen = explained.seen
    along = np.einsum("ij,ij->i", seen.normals, explained.feet[1][: len(seen.normals)])
    lost = np.minimum((np.arccos(np.clip(along, -1, 1)) / _DIRECTION_RAD) ** 2 / 2, _LEAST_LIKELY)
    return -float(sum(lost[seen.sites == k].mean() for k in np.unique(seen.sites)))


def reason(best: Explained, tried: list[Explained]) -> str:
    """Why this shape, in one sentence."""
    error = 1e3 * held_out_error(best)
    others = [e for e in tried if e.shape.name != best.shape.name]
    text = f"predicts touches at places left out within {error:.2f} mm"
    if others:
        second = max(others, key=score)
        nearer = 1e3 * held_out_error(second)
        but = ", but less likely all told" if nearer < error else ""
        text += f" (next likeliest: {second.name}, {nearer:.2f} mm{but})"
    return text


def best_drawn(tried: Sequence[Explained], spacing_m: float) -> tuple[Explained, Drawn]:
    """The shape with the best score of those that can be drawn, and its drawing (reconstruct.shapes.drawing).

    A field beside a shape may run away where nothing was touched: below the support, or far beyond all that
    was. Raises SurfaceError where every one does.
    """
    for each in sorted(tried, key=score, reverse=True):
        drawn = draw(each, spacing_m)
        touched = np.vstack([each.seen.centres, each.seen.outline])
        size = np.ptp(touched, axis=0).max()
        beyond = np.maximum(drawn[0] - touched.max(axis=0), touched.min(axis=0) - drawn[0]).max()
        if beyond < size and drawn[0][:, 2].min() > -_BELOW_M:
            return each, drawn
    raise SurfaceError("no shape stays near what was touched: touch more places, all round the object")


def rivals_spread(vertices: np.ndarray, best: Explained, tried: list[Explained]) -> np.ndarray:
    """(n,) m: how far the other shapes lie from this one, weighted by how well they predict."""
    square = np.zeros(len(vertices))
    total = 1.0
    for other in tried:
        weight = np.exp(score(other) - score(best))
        if other is best or weight < 0.003:
            continue
        shell = draw(other, 0.005)[:2]
        square += weight * distance(*shell, vertices) ** 2
        total += weight
    return np.sqrt(square / total)
