"""A slab of known thickness, or a half-space: a box whose top goes through the first touches."""

from __future__ import annotations

import numpy as np

from palpate.mechanics.compliance.sites import SURFACE_EDGE_M
from palpate.mechanics.errors import SurfaceError
from palpate.mechanics.frames import support_axes
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh
from palpate.mechanics.statistics import biweight
from palpate.reconstruction.geometry.registration import DIRECTION_RAD, OffSurface, off_surface
from palpate.reconstruction.geometry.stated import GeometryOptions, Placed, base_of_rim, foot_rim
from palpate.reconstruction.steps.s4_surface import Surface

_FLAT = 0.01
"""Of the way between the touches: how flat what is called flat usually is."""
_MARGIN, _CELLS = 2.0, 40
"""A slab reaches this many thicknesses beyond the touches, in at most so many cells a side."""
_JUST_BELOW, _DEEP_CELLS = 0.99, 8
_DEEP, _SPREAD, _WIDE = 16.0, 2.0, 1.2
"""A half-space is a block so many contact radii deep, at least so many times as deep as the touches spread,
and so many times as wide as deep: its held base stiffens by what its free sides give back, to 2 % of the
contact's own compliance."""


def place_slab(presses: Presses, options: GeometryOptions, mesh_size_m: float) -> Placed:
    """A slab whose top goes through the first touches; a half-space is a slab far deeper than any contact."""
    radius = presses.tip_radius_m
    up, top, covariance, residual = _top(presses, options)
    contact = float(np.sqrt(radius * max(presses.depth_m.max(), 0.1 * radius)))
    spread = _spread(presses, up)
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
            method=options.kind,
            reason=f"{words}, {how}; first touches lie {1e3 * rms:.2f} mm rms off it",
        ),
        local_sd_m=local,
        # a slab is alike everywhere: it matters neither where along its top nor how it leans
        pose=None,
        mesh=mesh,
        base=base_of_rim(foot_rim(vertices, triangles, foot, up), foot, up, radius),
        residual_m=residual,
        about={
            "kind": options.kind,
            "pose": options.pose,
            "thickness_m": thickness,
            "residual_rms_m": rms,
            "residual_greatest_m": float(np.abs(residual).max()),
            "tilt_sd_rad": tilt_sd[:2].tolist(),
            "height_sd_m": float(tilt_sd[2]),
        },
        notes=tuple(notes),
        doubt=_doubt(presses, options),
    )


def _top(presses: Presses, options: GeometryOptions) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The plane of a flat top: the one that was touched (`_plane`), or z = 0 as it is given."""
    if options.pose == "given":
        residual = presses.centre[:, 2] - presses.tip_radius_m
        return np.array([0.0, 0.0, 1.0]), np.zeros(3), np.zeros((3, 3)), residual
    return _plane(presses)


def _spread(presses: Presses, up: np.ndarray) -> float:
    """m, how far apart touches lie along a top with normal `up`."""
    return float(np.ptp(presses.point @ support_axes(up)[:2].T, axis=0).max())


def off_the_plane(presses: Presses, options: GeometryOptions) -> OffSurface | None:
    """How far first touches lie off the plane that a slab or half-space has them on; None of too few."""
    up, _, _, residual = _top(presses, options)
    fitted, true_m = 3 * (options.pose == "auto"), _FLAT * _spread(presses, up)
    return off_surface(residual, presses.site, presses.onset_error_m, true_m, fitted)


def _doubt(presses: Presses, options: GeometryOptions) -> str:
    """Why the object is not flat; '' where first touches lie on a plane as they can, or are too few."""
    off = off_the_plane(presses, options)
    if off is None or not off.words:
        return ""
    return f"the object is no {options.kind}: {off.words}; give its shape with --shape, or trace its base"


def flat_mesh(size: np.ndarray, mesh_size_m: float, cells: int) -> TetMesh:
    """A slab of size (3,) m on its base, as fine at its surface as touches need (so that nothing is halved
    again), in at most so many cells a side.

    Where those are coarser, the solver of touches halves them at the surface; a deep block then is of cells
    that halving makes just fine enough, as cells that are little too coarse would become far too fine.
    """
    edge = max(min(mesh_size_m, SURFACE_EDGE_M, size[2] / 3), size[:2].max() / cells)
    halved = _JUST_BELOW * SURFACE_EDGE_M * 2.0 ** np.ceil(np.log2(edge / SURFACE_EDGE_M))
    if edge > SURFACE_EDGE_M and size[2] > _DEEP_CELLS * halved:
        edge = halved
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
            known = share / DIRECTION_RAD**2
            matrix = (slopes * w[:, None]).T @ slopes + np.diag([known.sum(), known.sum(), 1e-12])
            right = slopes.T @ (w * flat[:, 2]) - np.append(known @ lean[:, :2], 0.0)
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
