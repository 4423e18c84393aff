"""Which shape is the most likely: each is fitted and scored by the touches at places left out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.mechanics.errors import SurfaceError
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.nearest import distance
from palpate.reconstruction.shapes.candidates import first_guesses
from palpate.reconstruction.shapes.drawing import draw
from palpate.reconstruction.shapes.evidence import Evidence
from palpate.reconstruction.shapes.fit import Seen, fit
from palpate.reconstruction.shapes.kriging import Explained, explain

_CORRECTED = 6
"""So many of the best shapes are tried with a free residual field as well."""

_DIRECTION_RAD, _LEAST_LIKELY = np.radians(15.0), 3.0
"""Standard deviation of a first force's direction; what a place can cost at most, for a slip is no proof."""

_BELOW_M = 1e-4
"""No surface reaches this far below the support it stands on."""

Drawn = tuple[np.ndarray, np.ndarray, np.ndarray]


def try_shapes(evidence: Evidence, which: str = "auto", progress: Progress = silent) -> list[Explained]:
    """Every shape (or those named `which`), fitted, without and with a free residual field."""
    seen = Seen.of(evidence)
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
        error = 1e3 * held_out_error(second)
        text += f" (next best, {second.name}: {error:.2f} mm)"
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
