"""A known geometry, registered to the first touches or as it stands: a file's shape; a slab (`slab`).

No tracing is needed and no more of the surface than was touched. What the registration leaves uncertain goes
into the modulus's interval (reconstruct.steps.s7_modulus.shape_error).
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from palpate.mechanics.disk.mesh_parts import words_of
from palpate.mechanics.disk.surface_files import ClosedSurface, read_surface
from palpate.mechanics.errors import ContactError, SurfaceError
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.flat_foot import Standing, direction, standing
from palpate.mechanics.shape.tetmesh import vertex_normals
from palpate.mechanics.shape.true_shape import TrueShape
from palpate.reconstruction.geometry.registration import (
    PAYS,
    SURFACE_SD_M,
    Registration,
    ShapeToPlace,
    TouchedPoints,
    nats_for_radii,
    off_surface,
    register,
)
from palpate.reconstruction.geometry.slab import place_slab
from palpate.reconstruction.geometry.stated import GeometryOptions, Placed, base_of_rim, foot_rim
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.shapes.drawing import decimated
from palpate.reconstruction.shapes.polyhedron import refine
from palpate.reconstruction.steps.s2_base import BoundaryOptions
from palpate.reconstruction.steps.s4_surface import Surface
from palpate.reconstruction.steps.s7_modulus.shape_error import PoseError

_ALIKE = 1.5
"""A rival pose whose residual is less than this times the best one's cannot be ruled out."""
OPEN = 0.015
"""Of its size, the diagonal: a surface whose place is open by more (one standard deviation) stands in no
known way. A dome that leans by 6 degrees, 0.035, had a loose base named; by 3.5 degrees, none."""
_TRUE = 0.005
"""Of the size: how true to the object a file usually is (a cast shrinks, soft things settle)."""
_FAR = 0.1
"""Of the size: a median residual beyond this is another object, unit or frame."""


def place(
    first: Measured,
    options: GeometryOptions,
    *,
    mesh_size_m: float,
    spacing_m: float,
    progress: Progress = silent,
) -> Placed:
    """Where a known geometry lies. first: the touches, found without any support.

    Raises SurfaceError where the file cannot be used or the touches do not lie on it.
    """
    presses = first.presses
    if not options.shape:
        return place_slab(presses, options, mesh_size_m)
    progress("registration", 0.0)
    given = read_surface(options.shape, options.unit, direction(options.up))
    stood = standing(given, options.up, options.sink_m)
    # cycles are contact that never breaks: of most presses a robot's, of some the tracing itself
    traces = options.pose == "auto" and 2 * presses.kinds.count("press") > len(presses)
    support = _traced_support(first) if traces else None
    body = ShapeToPlace(stood.vertices, stood.triangles, stood.support_point, stood.support_normal)
    touched = _touched(presses, support)
    free = options.pose == "auto"
    found = register(body, touched, free=free)
    progress("registration", 1.0)
    _check(given, found, options)
    placed = _placed(given, stood, found, options, spacing_m, presses.tip_radius_m)
    placed = dataclasses.replace(placed, doubt=_doubt(given, found, touched, free))
    return _by_radius(placed, given, body, touched, found) if free else placed


def _by_radius(
    placed: Placed, given: ClosedSurface, body: ShapeToPlace, touched: TouchedPoints, found: Registration
) -> Placed:
    """The same with what the first touches say of the tip's radius, beside the pose."""
    off_m = float(np.hypot(_TRUE * given.size_m, np.median(touched.error_m)))
    nats = nats_for_radii(body, touched, found, off_m)
    stated, likelier = touched.tip_radius_m, max(nats, key=lambda factor: nats[factor])
    other = touched.under(likelier * stated)
    # of another object's shape another tip may be likelier too, and lies off it all the same
    if nats[likelier] > PAYS and not _doubt(given, register(body, other), other, free=True):
        asked = "is it the diameter?" if likelier < 1 else "is that the diameter?"
        doubt = (
            f"the tip's radius may not be {1e3 * stated:.3g} mm: first touches lie on '{given.name}' under "
            f"one of {1e3 * other.tip_radius_m:.3g} mm, more than 1000 times likelier; {asked}"
        )
        return dataclasses.replace(placed, doubt=doubt, likelier_radius_m=other.tip_radius_m)
    if placed.doubt:
        return placed
    return dataclasses.replace(placed, open_radii=tuple(f for f in nats if nats[f] > -PAYS))


def _touched(presses: Presses, support: tuple[np.ndarray, np.ndarray] | None) -> TouchedPoints:
    return TouchedPoints(
        centres=presses.centre,
        normals=presses.contact_normal,
        error_m=presses.onset_error_m,
        site=presses.site,
        tip_radius_m=presses.tip_radius_m,
        support=support,
    )


def _traced_support(first: Measured) -> tuple[np.ndarray, np.ndarray] | None:
    """The support of a recording that traces it all the same; None where it does not."""
    if first.spans is None:
        return None
    try:
        found = first.spans.base(BoundaryOptions())
    except ContactError:
        return None
    # sliding on the object itself is no tracing: touches lie over a support
    above = np.median(found.height(first.presses.point)) > 2 * first.presses.tip_radius_m
    return (found.support_point, found.support_normal) if above else None


def _check(given: ClosedSurface, found: Registration, options: GeometryOptions) -> None:
    """Raises SurfaceError where the touches do not lie on the shape."""
    off = float(np.median(np.abs(found.residual_m)))
    if off <= max(_FAR * given.size_m, 2e-3 * given.size_m):
        return
    if options.pose == "given":
        raise SurfaceError(
            f"first touches lie {1e3 * off:.1f} mm off '{given.name}' as it stands (median; it is "
            f"{1e3 * given.size_m:.0f} mm across): register it with --pose auto, or mend --unit or the frame"
        )
    raise SurfaceError(
        f"'{given.name}' cannot be registered: first touches stay {1e3 * off:.1f} mm off (median; it is "
        f"{1e3 * given.size_m:.0f} mm across): is --unit {options.unit} right, and is it this object?"
    )


def _doubt(given: ClosedSurface, found: Registration, touched: TouchedPoints, free: bool) -> str:
    """Why the shape is another object's; '' where first touches lie on it as they can, or are too few."""
    off = off_surface(found.residual_m, touched.site, touched.error_m, _TRUE * given.size_m, 6 * free)
    if off is None or not off.words:
        return ""
    return f"'{given.name}' may be another object's shape: {off.words}; check the file, --unit and --pose"


def _placed(
    given: ClosedSurface,
    stood: Standing,
    found: Registration,
    options: GeometryOptions,
    spacing_m: float,
    tip_radius_m: float,
) -> Placed:
    spacing = max(spacing_m, given.size_m / 60)
    vertices, triangles = refine(stood.vertices, stood.triangles, spacing)
    vertices = found.to_device(vertices)
    normals = vertex_normals(vertices, triangles)
    modes = found.modes(vertices, normals)
    local = max(found.rms_m, SURFACE_SD_M * given.size_m / 0.1)
    up = found.rotation @ stood.support_normal
    foot = found.to_device(stood.support_point[None])[0]
    fixed = options.pose == "given"
    by_pose = np.sqrt((modes**2).sum(axis=1))
    open_m = float(np.percentile(by_pose, 95))
    how = "as it stands in the device frame" if fixed else "registered to the first touches"
    notes = list(given.notes)
    if given.parts:
        notes.append(
            f"{given.name} holds {words_of(given.parts)}: one modulus is fitted to them all; palpate model "
            f"{given.name} --modulus NAME=PA states each part's own"
        )
    if np.isfinite(found.rival_m) and found.rival_m < _ALIKE * found.rms_m:
        notes.append(
            f"another pose of {given.name} fits almost as well ({1e3 * found.rival_m:.2f} against "
            f"{1e3 * found.rms_m:.2f} mm): touch a place that separates them, or give --pose given"
        )
    if open_m > OPEN * float(np.linalg.norm(np.ptp(vertices, axis=0))):
        notes.append(
            f"the touches leave the place of {given.name} open by up to {1e3 * open_m:.0f} mm (standard "
            "deviation): touch its other faces, or give --pose given"
        )

    def redraw(edge_m: float) -> tuple[np.ndarray, np.ndarray]:
        coarse, faces = decimated(stood, edge_m)
        return found.to_device(coarse), faces

    surface = Surface(
        vertices=vertices,
        triangles=triangles,
        uncertainty_m=np.hypot(local, np.minimum(by_pose, 0.5 * given.size_m)),
        support_point=foot,
        support_normal=up,
        method="known shape",
        reason=f"{given.name}, {how}; first touches lie {1e3 * found.rms_m:.2f} mm rms off it",
        redraw=redraw,
        shape=TrueShape(found.to_device(stood.vertices), stood.triangles),
    )
    about = {
        "kind": "shape",
        "file": Path(options.shape).name,
        "unit": options.unit,
        "pose": options.pose,
        "rotation": found.rotation.tolist(),
        "shift_m": found.shift_m.tolist(),
        "residual_rms_m": found.rms_m,
        "residual_median_m": float(np.median(found.residual_m)),
        "residual_greatest_m": float(np.abs(found.residual_m).max()),
        "touches_left_out": int((found.weight < 0.01).sum()),
        "rival_rms_m": found.rival_m if np.isfinite(found.rival_m) else None,
        "pivot_m": found.pivot.tolist(),
        "shift_sd_m": np.sqrt(np.diag(found.covariance)[:3]).tolist(),
        "turn_sd_rad": np.sqrt(np.diag(found.covariance)[3:]).tolist(),
        "surface_sd_p95_m": open_m,
    }
    rim = foot_rim(vertices, triangles, foot, up)
    return Placed(
        surface=surface,
        local_sd_m=local,
        pose=None if fixed else PoseError(found.covariance, found.pivot),
        mesh=None,
        base=base_of_rim(rim, foot, up, tip_radius_m),
        residual_m=found.residual_m,
        about=about,
        notes=tuple(notes),
    )
