"""A geometry that is known: a file's shape, a slab of known thickness, a half-space; registered or as it
stands.

No tracing is needed and no more of the surface than was touched. What the registration leaves uncertain goes
into the modulus's interval (reconstruct.steps.s7_modulus.shape_error).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.box_mesh import box_mesh
from mechanics.errors import ContactError, OptionError, SurfaceError
from mechanics.options import option
from mechanics.presses import Presses
from mechanics.progress import Progress, silent
from mechanics.recording import Recording
from mechanics.robust import biweight
from mechanics.sites import SURFACE_EDGE_M
from mechanics.standing import Standing, standing
from mechanics.surface_files import UNITS, ClosedSurface, read_surface
from mechanics.tetmesh import TetMesh, vertex_normals
from reconstruct.geometry.known_base import base_of_rim
from reconstruct.geometry.registration import (
    DIRECTION_RAD,
    SURFACE_SD_M,
    Body,
    Registration,
    Touched,
    register,
)
from reconstruct.shapes.decimation import decimated
from reconstruct.shapes.evidence import support_axes
from reconstruct.shapes.polyhedron import refine
from reconstruct.steps.s2_base.outline import Boundary, BoundaryOptions
from reconstruct.steps.s3_contacts.contacts import Exploration
from reconstruct.steps.s4_surface.surface import Surface
from reconstruct.steps.s7_modulus.shape_error import PoseError

POSES = ("auto", "given")
_MARGIN, _CELLS = 2.0, 40
"""A slab reaches this many thicknesses beyond the touches, in at most so many cells a side."""
_DEEP, _SPREAD, _WIDE = 16.0, 2.0, 1.2
"""A half-space is a block so many contact radii deep, at least so many times as deep as the touches spread,
and so many times as wide as deep: its held base stiffens by what its free sides give back, to 2 % of the
contact's own compliance."""
_ALIKE = 1.5
"""A rival pose whose residual is less than this times the best one's cannot be told from it."""
_FAR = 0.1
"""Of the size: a median residual beyond this is another object, unit or frame."""


@dataclass(frozen=True)
class GeometryOptions:
    """The object's geometry where it is known: then no tracing is needed."""

    shape: str = option("", "file of the object's shape: STL, OBJ, PLY, glTF, VTP, VTU, MSH, INP")
    unit: str = option("m", "unit of length in the shape's file", choices=tuple(UNITS))
    pose: str = option(
        "auto",
        "where the shape lies: auto registers it to the first touches, given takes the device frame as it "
        "stands (a slab's top is then z = 0)",
        choices=POSES,
    )
    up: str = option("+z", "direction out of the support, in the shape's frame: +z, -x, ... or X,Y,Z")
    sink_m: float = option(
        0.0, "cut off flat at the shape's bottom, where the object settles", unit="m", flag="--sink"
    )
    slab_m: float | None = option(
        None, "the object is a slab of this thickness; None: it is none", unit="m", flag="--slab"
    )
    half_space: bool = option(False, "the object is deep and wide beside every contact")

    def __post_init__(self) -> None:
        """Raises OptionError for two geometries at once, or a thickness that is not positive."""
        given = [bool(self.shape), self.slab_m is not None, self.half_space]
        if sum(given) > 1:
            raise OptionError("--shape, --slab and --half-space exclude one another: give one")
        if self.slab_m is not None and not 0 < self.slab_m <= 2:
            raise OptionError(f"--slab is {self.slab_m} m; it must lie between 0 and 2 m")

    @property
    def known(self) -> bool:
        """Whether a geometry was given."""
        return bool(self.shape) or self.slab_m is not None or self.half_space


_STATED = {
    "shape": "shape",
    "shape_unit": "unit",
    "shape_pose": "pose",
    "shape_up": "up",
    "shape_sink_m": "sink_m",
    "slab_m": "slab_m",
    "half_space": "half_space",
}
"""Keys of a recording's [object], and the options that they stand for."""


def stated_geometry(recording: Recording, options: GeometryOptions) -> GeometryOptions:
    """The options, or what the recording's [object] says where they give no geometry."""
    thing = recording.description.get("object", {})
    if options.known or not isinstance(thing, Mapping):
        return options
    keys: dict[str, Any] = {option: thing[key] for key, option in _STATED.items() if key in thing}
    if "shape" in keys and recording.path is not None:
        keys["shape"] = str(recording.path.parent / str(keys["shape"]))
    try:
        return dataclasses.replace(options, **keys)
    except TypeError as error:
        raise OptionError(
            f"[object] of '{recording.name}' holds a value of the wrong kind: {error}"
        ) from error


@dataclass(frozen=True)
class Placed:
    """A known geometry in the device frame.

    surface: closed, its uncertainty that of pose and file together. local_sd_m: of the file alone. pose: its
    error, None where it is taken as given. mesh: of a slab, which needs no mesher; None for a shape. base:
    as a tracing would have told it. residual_m: (k,) of the first touches. about: what model.toml keeps,
    [geometry]. notes: what the user should know, one line each.
    """

    surface: Surface
    local_sd_m: float
    pose: PoseError | None
    mesh: TetMesh | None
    base: Boundary
    residual_m: np.ndarray
    about: dict[str, Any]
    notes: tuple[str, ...]

    @property
    def by_itself(self) -> Surface:
        """The surface with the file's uncertainty alone: the pose moves all of it together."""
        local = np.full(len(self.surface.vertices), self.local_sd_m)
        return dataclasses.replace(self.surface, uncertainty_m=local)


def nowhere(recording: Recording) -> Boundary:
    """A support so far below that nothing touches it, for a first look at the touches."""
    up = np.array([0.0, 0.0, 1.0])
    corners = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], dtype=float)
    rim = np.vstack([corners, 0.5 * corners]) + recording.position.mean(axis=0) - 1e3 * up
    return base_of_rim(rim, rim[0], up, recording.tip_radius_m)


def place(
    recording: Recording,
    first: Exploration,
    options: GeometryOptions,
    *,
    mesh_size_m: float,
    spacing_m: float,
    progress: Progress = silent,
) -> Placed:
    """Where a known geometry lies. first: the touches, told without any support.

    Raises SurfaceError where the file cannot be used or the touches do not lie on it.
    """
    presses = first.presses
    if not options.shape:
        return _slab(presses, options, mesh_size_m)
    progress("registration", 0.0)
    given = read_surface(options.shape, options.unit)
    stood = standing(given, options.up, options.sink_m)
    traces = options.pose == "auto" and set(presses.kinds) == {"press"}
    support = _traced_support(first) if traces else None
    body = Body(stood.vertices, stood.triangles, stood.support_point, stood.support_normal)
    touched = _touched(presses, support)
    found = register(body, touched, free=options.pose == "auto")
    progress("registration", 1.0)
    _check(given, found, options)
    return _placed(given, stood, found, options, spacing_m, recording.tip_radius_m)


def _touched(presses: Presses, support: tuple[np.ndarray, np.ndarray] | None) -> Touched:
    return Touched(
        centres=presses.centre,
        normals=presses.contact_normal,
        error_m=presses.onset_error_m,
        site=presses.site,
        tip_radius_m=presses.tip_radius_m,
        support=support,
    )


def _traced_support(first: Exploration) -> tuple[np.ndarray, np.ndarray] | None:
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
    if np.isfinite(found.rival_m) and found.rival_m < _ALIKE * found.rms_m:
        notes.append(
            f"another pose of {given.name} fits nearly as well ({1e3 * found.rival_m:.2f} against "
            f"{1e3 * found.rms_m:.2f} mm): touch what tells them apart, or give --pose given"
        )
    if open_m > 0.05 * given.size_m:
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
    rim = _rim(vertices, triangles, foot, up)
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


def _rim(vertices: np.ndarray, triangles: np.ndarray, foot: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(k, 3) nodes of the foot that belong to a wall as well, in order round their middle."""
    low = np.abs((vertices - foot) @ up) < 1e-7
    down = low[triangles].all(axis=1)
    nodes = np.intersect1d(np.unique(triangles[down]), np.unique(triangles[~down]))
    axes = support_axes(up)
    offset = vertices[nodes] - vertices[nodes].mean(axis=0)
    return vertices[nodes][np.argsort(np.arctan2(offset @ axes[1], offset @ axes[0]))]


def _slab(presses: Presses, options: GeometryOptions, mesh_size_m: float) -> Placed:
    """A slab whose top goes through the first touches; a half-space is a slab far deeper than any contact."""
    radius = presses.tip_radius_m
    if options.pose == "given":
        up, top, covariance = np.array([0.0, 0.0, 1.0]), np.zeros(3), np.zeros((3, 3))
        residual = presses.centre[:, 2] - radius
    else:
        up, top, covariance, residual = _plane(presses)
    contact = float(np.sqrt(radius * max(presses.depth_m.max(), 0.1 * radius)))
    spread = float(np.ptp(presses.point @ support_axes(up)[:2].T, axis=0).max())
    thickness = options.slab_m or max(_DEEP * contact, _SPREAD * spread)
    if presses.depth_m.max() >= thickness:
        raise SurfaceError(
            f"presses go {1e3 * presses.depth_m.max():.2g} mm deep into a slab of {1e3 * thickness:.2g} mm: "
            "state its true thickness, in metres"
        )
    if np.median(np.abs(residual)) > 0.5 * thickness:
        raise SurfaceError(
            f"first touches lie {1e3 * np.median(np.abs(residual)):.1f} mm (median) off the slab's top: "
            + ("register it with --pose auto" if options.pose == "given" else "it is no slab")
        )
    axes = support_axes(up)
    flat = (presses.point - top) @ axes.T
    low, high = flat[:, :2].min(axis=0), flat[:, :2].max(axis=0)
    middle = top + ((low + high) / 2) @ axes[:2]
    wide = high - low + 2 * _MARGIN * thickness if options.slab_m else np.full(2, _WIDE * thickness)
    size = np.append(wide, thickness)
    box = flat_mesh(size, mesh_size_m, _CELLS if options.slab_m else _CELLS // 2)
    points = (box.points - [0, 0, thickness]) @ axes + middle
    mesh = TetMesh(points, box.tetrahedra, box.fixed, box.touchable)
    vertices, triangles = _shell(mesh)
    rms = float(np.sqrt(np.mean(np.minimum(residual**2, 9 * np.median(residual**2) + 1e-12))))
    local = max(rms, 2e-4 * float(np.ptp(flat[:, :2], axis=0).max() + radius) / 0.1)
    foot = middle - thickness * up
    tilt_sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    words = f"a slab {1e3 * thickness:.3g} mm thick" if options.slab_m else "a half-space"
    how = "its top on z = 0" if options.pose == "given" else "its top through the first touches"
    notes = []
    if (tilt_sd[:2] > np.radians(3)).any():
        notes.append(
            f"the touches leave the tilt of the top open by {np.degrees(tilt_sd[:2].max()):.0f} degrees "
            "(standard deviation): touch places that do not lie on one line"
        )
    return Placed(
        surface=Surface(
            vertices=vertices,
            triangles=triangles,
            uncertainty_m=np.full(len(vertices), local),
            support_point=foot,
            support_normal=up,
            method="half-space" if options.half_space else "slab",
            reason=f"{words}, {how}; first touches lie {1e3 * rms:.2f} mm rms off it",
        ),
        local_sd_m=local,
        # a slab is alike everywhere: it matters neither where along its top nor how it leans
        pose=None,
        mesh=mesh,
        base=base_of_rim(_rim(vertices, triangles, foot, up), foot, up, radius),
        residual_m=residual,
        about={
            "kind": "half-space" if options.half_space else "slab",
            "pose": options.pose,
            "thickness_m": thickness,
            "residual_rms_m": rms,
            "residual_greatest_m": float(np.abs(residual).max()),
            "tilt_sd_rad": tilt_sd[:2].tolist(),
            "height_sd_m": float(tilt_sd[2]),
        },
        notes=tuple(notes),
    )


def flat_mesh(size: np.ndarray, mesh_size_m: float, cells: int) -> TetMesh:
    """A slab of size (3,) m on its base, as fine at its surface as touches need (so that nothing is halved
    again), in at most so many cells a side."""
    edge = max(min(mesh_size_m, SURFACE_EDGE_M, size[2] / 3), size[:2].max() / cells)
    nx, ny, nz = (max(3, int(np.ceil(length / edge))) for length in size)
    return box_mesh((nx, ny, nz), tuple(size))


def half_space_size(contact_m: float) -> np.ndarray:
    """(3,) m, of a block that is a half-space to a contact of that radius at its middle."""
    deep = _DEEP * contact_m
    return np.array([_WIDE * deep, _WIDE * deep, deep])


def _plane(presses: Presses) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The plane that the tip touched: normal (3,), point (3,), covariance (3, 3) of its two tilts and height,
    residuals (k,) m of the first touches."""
    centre, share = presses.centre, 1.0 / np.bincount(presses.site)[presses.site]
    sigma = np.hypot(presses.onset_error_m, 1e-3 * presses.tip_radius_m + 5e-5)
    up = np.average(presses.contact_normal, axis=0, weights=share)
    up /= np.linalg.norm(up)
    middle = np.average(centre, axis=0, weights=share)
    for _ in range(6):
        axes = support_axes(up)
        flat, lean = (centre - middle) @ axes.T, presses.contact_normal @ axes.T
        slopes = np.column_stack([flat[:, :2], np.ones(len(flat))])

        def fit(
            weight: np.ndarray, flat: np.ndarray = flat, lean: np.ndarray = lean, slopes: np.ndarray = slopes
        ) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
            w = weight * share / sigma**2
            told = share / DIRECTION_RAD**2
            matrix = (slopes * w[:, None]).T @ slopes + np.diag([told.sum(), told.sum(), 1e-12])
            right = slopes.T @ (w * flat[:, 2]) - np.append(told @ lean[:, :2], 0.0)
            found = np.linalg.solve(matrix, right)
            return (found, np.linalg.inv(matrix)), flat[:, 2] - slopes @ found

        robust = biweight(fit, len(centre), least=float(np.median(sigma)))
        (a, b, height), covariance = robust.fitted
        middle = middle + height * up
        up = up - a * axes[0] - b * axes[1]
        up /= np.linalg.norm(up)
    return up, middle - presses.tip_radius_m * up, covariance, robust.residual


def _shell(mesh: TetMesh) -> tuple[np.ndarray, np.ndarray]:
    """The mesh's boundary as a surface of its own: vertices and triangles."""
    used, index = np.unique(mesh.surface[:, :3], return_inverse=True)
    return mesh.points[used], index.reshape(-1, 3)
