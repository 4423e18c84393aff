"""What touches say about a shape: where its spherical tip met the object and the support.

Shapes are fitted in the support frame: origin on the support below the middle of the base, z along the
support's normal. A touch says that the tip's centre is one tip radius away from the surface; its force says
roughly where the surface faces.

Robust fit of a shape to the touches and to the base's outline, the lean of the tracing included.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from palpate.mechanics.errors import SurfaceError
from palpate.mechanics.frames import support_axes
from palpate.mechanics.presses.repeats import sites_of
from palpate.reconstruction.shapes.shape import Shape, values_of

LEAST_TOUCHES = 4
"""Fewer carry no surface."""


@dataclass(frozen=True)
class Evidence:
    """Touches and base outline; device frame, m.

    support_point, support_normal: (3,), the support's plane, normal into the object. outline: (k, 3) rim of
    the base on the support, tip radius taken off, ordered along the path (which may overlap itself).
    outline_centres: (k, 3) the tip's centre there, one tip radius above the support. centres: (m, 3) tip's
    centre at first touch. normals: (m, 3) outward unit normals from the first force, a few degrees wrong.
    centre_error_m: (m,) standard deviation of a centre along the normal. site: (m,) number of the place of
    each touch, repeats share one; None: by distance.
    Raises SurfaceError where arrays disagree, are not finite or hold too few points.
    """

    support_point: np.ndarray
    support_normal: np.ndarray
    outline: np.ndarray
    outline_centres: np.ndarray
    centres: np.ndarray
    normals: np.ndarray
    centre_error_m: np.ndarray
    tip_radius_m: float
    site: np.ndarray | None = None

    def __post_init__(self) -> None:
        for name in ("support_point", "support_normal", "outline", "outline_centres", "centres", "normals"):
            value = np.array(getattr(self, name), dtype=float)
            if not np.isfinite(value).all():
                raise SurfaceError(f"{name} of the touches holds values that are not finite")
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        error = np.broadcast_to(np.asarray(self.centre_error_m, dtype=float), (len(self.centres),)).copy()
        error.setflags(write=False)
        object.__setattr__(self, "centre_error_m", error)
        if self.outline.ndim != 2 or len(self.outline) < 8:
            raise SurfaceError(
                f"the base outline has {len(self.outline)} points; 8 are needed: trace the whole base"
            )
        if self.centres.ndim != 2 or len(self.centres) < LEAST_TOUCHES:
            raise SurfaceError(
                f"{len(self.centres)} touches carry no surface; at least {LEAST_TOUCHES} are needed: touch "
                "more places"
            )
        if self.normals.shape != self.centres.shape or self.outline_centres.shape != self.outline.shape:
            raise SurfaceError("normals need one row a touch, outline_centres one row an outline point")
        if not self.tip_radius_m >= 0:
            raise SurfaceError(f"tip_radius_m is {self.tip_radius_m}; it must not be negative")
        if self.site is None:
            object.__setattr__(self, "site", sites_of(self.centres, self.normals))

    @property
    def points(self) -> np.ndarray:
        """(m, 3) surface points at first touch, device frame."""
        return self.centres - self.tip_radius_m * self.normals

    @cached_property
    def axes(self) -> np.ndarray:
        """(3, 3), rows: unit vectors of the support frame in the device frame, right-handed, the third up."""
        return support_axes(self.support_normal)

    @cached_property
    def origin(self) -> np.ndarray:
        """(3,) origin of the support frame: on the support, middle of the outline's extent."""
        flat = (self.outline - self.support_point) @ self.axes.T
        middle = (flat.max(axis=0) + flat.min(axis=0)) / 2
        return self.support_point + middle[:2] @ self.axes[:2]

    def to_support(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) from the device frame into the support frame."""
        return (np.asarray(points) - self.origin) @ self.axes.T

    def to_device(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) from the support frame into the device frame."""
        return np.asarray(points) @ self.axes + self.origin


LEAN_M, LEAN_SPREAD_M = 0.00025, 0.0002
"""How far a tracing hand leans the tip into the object's foot: prior mean and standard deviation."""

OUTLINE_ERROR_M = 0.0002
"""What is left of the outline's error beside the common lean, a standard deviation."""

_OUTLINE_POINTS = 48
_ROBUST_M = 0.0003
_WEAK = 3.0  # prior spreads: holds only what no touch can tell, such as the slope of a top touched once


@dataclass(frozen=True)
class ShapeEvidence:
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
    def of(cls, evidence: Evidence) -> ShapeEvidence:
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


def residuals(shape: Shape, seen: ShapeEvidence, lean_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Gap (m,) between the shape and the touching tip, and (k,) the same along the outline; m, outward
    positive."""
    found = shape.distance(np.vstack([seen.centres, seen.outline])) - seen.tip_radius_m
    return found[: len(seen.centres)], found[len(seen.centres) :] + lean_m


def fit(shape: Shape, seen: ShapeEvidence) -> tuple[Shape, float]:
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
