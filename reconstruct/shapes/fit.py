"""Robust fit of a shape to the touches and to the base's outline, the lean of the tracing included."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from palpate.reconstruction.shapes.evidence import Evidence
from palpate.reconstruction.shapes.shape import Shape, values_of

LEAN_M, LEAN_SPREAD_M = 0.00025, 0.0002
"""How far a tracing hand leans the tip into the object's foot: prior mean and standard deviation."""

OUTLINE_ERROR_M = 0.0002
"""What is left of the outline's error beside the common lean, a standard deviation."""

_OUTLINE_POINTS = 48
_ROBUST_M = 0.0003
_WEAK = 3.0  # prior spreads: holds only what no touch can tell, such as the slope of a top touched once


@dataclass(frozen=True)
class Seen:
    """The evidence as the fits want it: support frame, the outline thinned.

    centres: (m, 3). outline: (k, 3) tip's centre. normals: (m, 3). error_m: (m,). sites: (m,) place number of
    each touch; repeats share one.
    """

    centres: np.ndarray
    outline: np.ndarray
    normals: np.ndarray
    error_m: np.ndarray
    sites: np.ndarray
    tip_radius_m: float

    @classmethod
    def of(cls, evidence: Evidence) -> Seen:
        """Thin the outline evenly by angle, medians of what overlaps."""
        rim = evidence.to_support(evidence.outline_centres)
        angle = np.arctan2(rim[:, 1], rim[:, 0])
        sector = np.floor((angle + np.pi) / (2 * np.pi) * _OUTLINE_POINTS).astype(int) % _OUTLINE_POINTS
        outline = []
        for k in np.unique(sector):
            members = rim[sector == k]
            middle = np.median(members, axis=0)
            outline.append(members[np.argmin(np.linalg.norm(members - middle, axis=1))])
        centres = evidence.to_support(evidence.centres)
        return cls(
            centres=centres,
            outline=np.array(outline),
            normals=evidence.normals @ evidence.axes.T,
            error_m=np.asarray(evidence.centre_error_m),
            sites=np.asarray(evidence.site),
            tip_radius_m=evidence.tip_radius_m,
        )


def residuals(shape: Shape, seen: Seen, lean_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Gap (m,) between the shape and the touching tip, and (k,) the same along the outline; m, outward
    positive."""
    found = shape.distance(np.vstack([seen.centres, seen.outline])) - seen.tip_radius_m
    return found[: len(seen.centres)], found[len(seen.centres) :] + lean_m


def fit(shape: Shape, seen: Seen) -> tuple[Shape, float]:
    """The shape that touches best, and the lean of the tracing (m)."""
    start = values_of(shape)
    spread = np.array([p.spread for p in shape.parameters])
    low = np.array([p.low for p in shape.parameters])
    high = np.array([p.high for p in shape.parameters])
    weak = _WEAK * spread

    def cost(x: np.ndarray) -> np.ndarray:
        at = np.clip(x[:-1] * spread, low, high)
        touch, rim = residuals(shape.with_values(at), seen, x[-1] * LEAN_SPREAD_M)
        return np.concatenate(
            [
                _robust(touch / _ROBUST_M),
                _robust(rim / (2 * OUTLINE_ERROR_M)),
                [x[-1] - LEAN_M / LEAN_SPREAD_M],
                (x[:-1] * spread - start) / weak,
            ]
        )

    x0 = np.append(start / spread, LEAN_M / LEAN_SPREAD_M)
    bounds = (np.append(low / spread, -np.inf), np.append(high / spread, np.inf))
    x0 = np.clip(x0, bounds[0] + 1e-9, bounds[1] - 1e-9)
    found = least_squares(cost, x0, bounds=bounds, max_nfev=40, xtol=1e-6, ftol=1e-7)
    return shape.with_values(found.x[:-1] * spread), float(found.x[-1] * LEAN_SPREAD_M)


def _robust(x: np.ndarray) -> np.ndarray:
    # square root of the pseudo-Huber loss, signed: linear growth beyond a few standard deviations
    scale = 3.0
    return np.sign(x) * scale * np.sqrt(2 * (np.sqrt(1 + (x / scale) ** 2) - 1))
