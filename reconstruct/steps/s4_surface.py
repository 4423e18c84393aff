"""Contacts cast onto the reconstructed surface (paper, section 2.2).

The surface of a touched object: candidates from `reconstruct.shapes`, one chosen with its reason.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import trimesh

from palpate.mechanics.errors import SurfaceError
from palpate.mechanics.frames import support_axes
from palpate.mechanics.options import option
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.nearest import facings
from palpate.mechanics.shape.tetmesh import vertex_normals
from palpate.mechanics.shape.true_shape import TrueShape
from palpate.reconstruction.shapes.choice import (
    FITTED,
    HiddenOutlineError,
    best_drawn,
    held_out_error,
    reason,
    rivals_spread,
    score,
    try_shapes,
)
from palpate.reconstruction.shapes.drawing import balanced, draw
from palpate.reconstruction.shapes.fit import LEAST_TOUCHES, Evidence, ShapeEvidence
from palpate.reconstruction.shapes.implicit import implicit_deviation, implicit_held_out, implicit_surface
from palpate.reconstruction.shapes.polyhedron import (
    gap_to_other_bound,
    hull_surface,
    refine,
    tangent_surface,
    volume_bounds,
)

if TYPE_CHECKING:
    from palpate.reconstruction.measured import Measured


@dataclass(frozen=True)
class CastPoints:
    """Nearest surface points (k, 3) m, outward unit normals there (k, 3), triangle (k,)."""

    points: np.ndarray
    normals: np.ndarray
    triangle: np.ndarray

    def on(self, shape: TrueShape | None) -> CastPoints:
        """The same on the shape that the surface draws; themselves where none is known."""
        if shape is None:
            return self
        return CastPoints(*shape.foot(self.points, self.normals), self.triangle)

    def of(self, chosen: np.ndarray) -> CastPoints:
        """Only some of them, (k,) bool."""
        return CastPoints(self.points[chosen], self.normals[chosen], self.triangle[chosen])


def cast(
    vertices: np.ndarray,
    triangles: np.ndarray,
    points: np.ndarray,
    measured_normals: np.ndarray | None = None,
) -> CastPoints:
    """Nearest points of a triangle surface (outward by the right-hand rule), smooth normals between vertices.

    With measured normals (k, 3), triangles that face away from a contact's normal by more than 75 degrees are
    passed over, so that a touch beside an edge stays on its own face.
    """
    triangles = triangles[:, :3]
    corners, (_, facing) = vertices[triangles], facings(vertices, triangles)
    smooth = vertex_normals(vertices, triangles)
    where = np.empty_like(points)
    normals = np.empty_like(points)
    chosen = np.empty(len(points), dtype=int)
    for i, point in enumerate(points):
        allowed = np.arange(len(triangles))
        if measured_normals is not None:
            allowed = np.flatnonzero(facing @ measured_normals[i] > np.cos(np.radians(75)))
            allowed = allowed if len(allowed) else np.arange(len(triangles))
        # not mechanics.shape.nearest: every contact has triangles of its own to choose among
        nearest = trimesh.triangles.closest_point(corners[allowed], np.tile(point, (len(allowed), 1)))
        best = int(np.argmin(np.linalg.norm(nearest - point, axis=1)))
        where[i], chosen[i] = nearest[best], allowed[best]
        share = trimesh.triangles.points_to_barycentric(corners[[chosen[i]]], where[[i]])[0]
        # vertex normals of an edge lean over it: only those near the triangle's own take part
        near = smooth[triangles[chosen[i]]] @ facing[chosen[i]] > np.cos(np.radians(30))
        normal = (np.where(near, share, 0.0)[:, None] * smooth[triangles[chosen[i]]]).sum(axis=0)
        normal = facing[chosen[i]] if np.linalg.norm(normal) < 0.2 else normal
        normals[i] = normal / np.linalg.norm(normal)
    return CastPoints(where, normals, chosen)


SURFACES = ("auto", "hull", "tangent", "implicit", *FITTED)

_POOR_M = 0.0012
"""Above this held-out error of the best shape, the implicit surface is tried as well."""

_LOOSE_M, _LOOSE = 0.0006, 3.0
"""A first touch whose own error is beyond this, and so many times the median's, places no surface."""

Redraw = Callable[[float], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class SurfaceOptions:
    """Which surface, and how finely it is drawn."""

    surface: str = option("auto", "shape of the object; auto chooses by held-out touches", choices=SURFACES)
    surface_spacing_m: float = option(
        0.003, "edge length of the surface's triangles", unit="m", flag="--surface-spacing"
    )


@dataclass(frozen=True)
class Surface:
    """A closed surface standing on the support; device frame, m.

    vertices: (n, 3). triangles: (m, 3), outward by the right-hand rule, base included. uncertainty_m: (n,)
    standard deviation of the surface along its normal at each vertex. support_point, support_normal: (3,).
    method: the shape's name, with '+' where a free field corrects it. reason: why it was chosen, in words.
    parameters: what the shape's fit found (support frame). held_out_m: rms error of touches that were held
    out, place by place, for every shape tried. bracket_m3: volumes of the hull of the touches and of the
    tangent planes' intersection, between which a convex object's lies. redraw: the same surface with
    triangles of another edge length (m), of the same volume; None where it has no finer truth. shape: what
    is known of it beforehand; None where it was found by the touches.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    uncertainty_m: np.ndarray
    support_point: np.ndarray
    support_normal: np.ndarray
    method: str
    reason: str
    parameters: Mapping[str, float] = field(default_factory=dict)
    held_out_m: Mapping[str, float] = field(default_factory=dict)
    bracket_m3: tuple[float, float] = (float("nan"), float("nan"))
    redraw: Redraw | None = field(default=None, repr=False, compare=False)
    shape: TrueShape | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not self.mesh.is_watertight:
            raise SurfaceError(
                f"the {self.method} surface is open: touch more places or choose another --surface"
            )
        if not self.mesh.volume > 0:
            raise SurfaceError(f"the {self.method} surface holds no volume: touch more places")

    @cached_property
    def mesh(self) -> trimesh.Trimesh:
        """The surface for trimesh (volume, sampling), vertices in order."""
        import trimesh

        return trimesh.Trimesh(self.vertices, self.triangles, process=False)

    @property
    def above_base(self) -> np.ndarray:
        """(n,) bool, the vertices that do not lie on the support."""
        return (self.vertices - self.support_point) @ self.support_normal > 1e-6

    @property
    def least_known(self) -> tuple[np.ndarray, float]:
        """The vertex above the base whose place is least known, (3,) m, and its standard deviation, m."""
        worst = int(np.argmax(np.where(self.above_base, self.uncertainty_m, 0.0)))
        return self.vertices[worst], float(self.uncertainty_m[worst])

    @cached_property
    def frame(self) -> np.ndarray:
        """(3, 3), rows: unit vectors of a frame on the support, right-handed, the third along its normal."""
        return support_axes(self.support_normal)

    @property
    def volume_m3(self) -> float:
        """Enclosed volume."""
        return float(self.mesh.volume)


def evidence_of(measured: Measured) -> Evidence:
    """What an exploration says about the shape; touches known far less well than most are left out.

    Raises SurfaceError where it has no base outline.
    """
    boundary, presses = measured.boundary, measured.presses
    if boundary is None:
        raise SurfaceError(
            "the recording has no base outline: trace the base or give a model whose base stands in"
        )
    error = presses.onset_error_m
    fourth = np.sort(error)[:LEAST_TOUCHES][-1]
    good = error <= max(_LOOSE_M, _LOOSE * float(np.median(error)), fourth)
    return Evidence(
        support_point=boundary.support_point,
        support_normal=boundary.support_normal,
        outline=boundary.outline,
        outline_centres=boundary.centres,
        centres=presses.centre[good],
        normals=presses.contact_normal[good],
        centre_error_m=error[good],
        site=presses.site[good],
        tip_radius_m=measured.recording.tip_radius_m,
    )


def reconstruct_surface(
    evidence: Evidence,
    options: SurfaceOptions | None = None,
    progress: Progress = silent,
    *,
    shaped: Callable[[Surface], object] | None = None,
) -> Surface:
    """The most likely surface by the touches and the base outline.

    shaped: called once its shape is there and its uncertainty and bounds are not, so that a mesher can begin.
    Raises SurfaceError where no closed surface can be made.
    """
    found = _found(evidence, options or SurfaceOptions(), progress, shaped or (lambda surface: None))
    progress("surface", 1.0)
    return found


def _found(
    evidence: Evidence, options: SurfaceOptions, progress: Progress, shaped: Callable[[Surface], object]
) -> Surface:
    if options.surface in ("hull", "tangent"):
        shells = {"hull": hull_surface, "tangent": tangent_surface}
        # finer than the facets need, so that the gap between the bounds is known inside them as well
        vertices, triangles = refine(*shells[options.surface](evidence), 2 * options.surface_spacing_m)
        gap = gap_to_other_bound(evidence, vertices, options.surface)
        return Surface(
            vertices=evidence.to_device(vertices),
            triangles=triangles,
            uncertainty_m=gap,
            support_point=evidence.origin,
            support_normal=evidence.axes[2],
            method=options.surface,
            reason="chosen in the options",
            bracket_m3=volume_bounds(evidence),
        )
    if options.surface == "implicit":
        return _implicit(evidence, options, "chosen in the options")
    try:
        tried = try_shapes(evidence, options.surface, progress)
    except HiddenOutlineError:
        if options.surface != "auto":
            raise
        return _implicit(
            evidence, options, "no point sees the whole base outline, which the other shapes need"
        )
    best, (vertices, triangles, deviation) = best_drawn(tried, options.surface_spacing_m)
    error = held_out_error(best)
    if options.surface == "auto" and error > _POOR_M:
        why = f"no shape explains the touches ({best.name}: {1e3 * error:.2f} mm)"
        # one that is open is no rival
        with suppress(SurfaceError):
            implicit = _implicit(evidence, options, why)
            if implicit.held_out_m["implicit"] < 0.8 * error:
                return implicit

    def redraw(spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
        coarse = draw(best, spacing_m)[:2]
        return evidence.to_device(balanced(coarse, (vertices, triangles))), coarse[1]

    surface = Surface(
        vertices=evidence.to_device(vertices),
        triangles=triangles,
        uncertainty_m=deviation,
        support_point=evidence.origin,
        support_normal=evidence.axes[2],
        method=best.name,
        reason="chosen in the options" if options.surface != "auto" else reason(best, tried),
        parameters={p.label: p.value for p in best.shape.parameters},
        held_out_m={e.name: held_out_error(e) for e in sorted(tried, key=score)},
        redraw=redraw,
    )
    shaped(surface)
    facing = best.feet[1][: len(evidence.centres)] @ evidence.axes
    return replace(
        surface,
        uncertainty_m=np.hypot(deviation, rivals_spread(vertices, best, tried)),
        bracket_m3=volume_bounds(replace(evidence, normals=facing)),
    )


def _implicit(evidence: Evidence, options: SurfaceOptions, why: str) -> Surface:
    vertices, triangles = implicit_surface(evidence, options.surface_spacing_m)
    error = implicit_held_out(evidence, ShapeEvidence.of(evidence))
    return Surface(
        vertices=evidence.to_device(vertices),
        triangles=triangles,
        uncertainty_m=implicit_deviation(evidence, vertices),
        support_point=evidence.origin,
        support_normal=evidence.axes[2],
        method="implicit",
        reason=f"{why}; predicts touches at places left out within {1e3 * error:.2f} mm",
        held_out_m={"implicit": error},
        bracket_m3=volume_bounds(evidence),
    )


def shape_table(surface: Surface) -> dict[str, Any]:
    """What a model keeps of its surface ([shape] in model.toml): method and reason, volumes, deviations.

    sd_median_m, sd_p95_m, sd_greatest_m: of the standard deviation over the vertices above the base.
    hull_volume_m3, tangent_volume_m3: bounds of a convex object. held_out_m: by shape tried. parameters: of
    the shape, in the support's frame.
    """
    deviation = surface.uncertainty_m[surface.above_base]
    low, high = surface.bracket_m3
    bounds = {"hull_volume_m3": low, "tangent_volume_m3": high}
    return {
        "surface": surface.method,
        "reason": surface.reason,
        "volume_m3": surface.volume_m3,
        **{name: value for name, value in bounds.items() if np.isfinite(value)},
        "sd_median_m": float(np.median(deviation)),
        "sd_p95_m": float(np.percentile(deviation, 95)),
        "sd_greatest_m": float(deviation.max()),
        "held_out_m": dict(surface.held_out_m),
        "parameters": dict(surface.parameters),
    }
