"""Phantoms: soft things that nobody had to build, as closed triangle surfaces in an object frame.

Object frame: metres, origin in the middle of the base, z up, the support is the plane z = 0. Every shape
here is a stack of rings over one star-shaped outline, so that one triangulation serves them all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from palpate.mechanics.disk.reading import no_file
from palpate.mechanics.disk.surface_files import SUFFIXES, is_surface_file, read_surface
from palpate.mechanics.errors import SceneError
from palpate.mechanics.names import unknown
from palpate.mechanics.plausible import USUAL_POISSON_RATIO
from palpate.mechanics.shape.flat_foot import standing

SPACING_M = 0.0018
"""Edge length of the surfaces' triangles, m."""


@dataclass(frozen=True)
class Region:
    """A ball of other stiffness inside a phantom: centre (3,) m, radius m, modulus over the
    matrix's modulus.
    """

    name: str
    centre_m: tuple[float, float, float]
    radius_m: float
    modulus_ratio: float


@dataclass(frozen=True)
class Phantom:
    """A closed surface with its material.

    vertices: (n, 3) m, object frame. faces: (m, 3), counter-clockwise from outside. young_modulus_pa: of
    the matrix. regions: balls of another modulus. shape: one line in words and metres.
    """

    name: str
    shape: str
    vertices: np.ndarray
    faces: np.ndarray
    young_modulus_pa: float
    poisson_ratio: float = USUAL_POISSON_RATIO
    regions: tuple[Region, ...] = field(default=())

    def __post_init__(self) -> None:
        for name, kind in (("vertices", float), ("faces", np.int64)):
            value = np.ascontiguousarray(getattr(self, name), dtype=kind)
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @property
    def height_m(self) -> float:
        """Greatest height above the support, m."""
        return float(self.vertices[:, 2].max())

    def with_modulus(self, young_modulus_pa: float) -> Phantom:
        """The same shape in another stiffness."""
        return replace(self, young_modulus_pa=float(young_modulus_pa))


def _stack(rings: np.ndarray, bottom: np.ndarray, top: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rings (k, n, 3), counter-clockwise from above and ordered from the base's middle over the wall to the
    top.
    """
    k, n = rings.shape[:2]
    vertices = np.vstack([rings.reshape(-1, 3), bottom, top])
    i = np.arange(n)
    j = (i + 1) % n
    faces = []
    for ring in range(k - 1):
        a, b = ring * n, (ring + 1) * n
        faces += [np.column_stack([a + i, a + j, b + j]), np.column_stack([a + i, b + j, b + i])]
    first, last = k * n, k * n + 1
    faces += [np.column_stack([np.full(n, first), j, i])]
    faces += [np.column_stack([(k - 1) * n + i, (k - 1) * n + j, np.full(n, last)])]
    return vertices, np.vstack(faces)


def resampled(corners: np.ndarray, spacing: float) -> np.ndarray:
    """Points along a polyline, corners kept."""
    pieces = []
    for a, b in zip(corners[:-1], corners[1:], strict=True):
        count = max(1, int(np.ceil(np.linalg.norm(b - a) / spacing)))
        pieces.append(a + (b - a) * np.arange(count)[:, None] / count)
    return np.vstack([*pieces, corners[-1:]])


def stacked(
    outline: np.ndarray,
    profile: np.ndarray,
    height: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """(vertices, faces) of a closed surface. outline (n, 2) m, star-shaped about the origin; profile (k, 2):
    scale of the outline and z; `height(xy, z)` may replace z by place.
    """
    scale, z = profile[:, 0], profile[:, 1]
    inner = (scale > 1e-9).nonzero()[0]
    rings = np.empty((len(inner), len(outline), 3))
    rings[..., :2] = scale[inner, None, None] * outline[None]
    rings[..., 2] = z[inner, None]
    ends = np.array([[0.0, 0.0, z[0]], [0.0, 0.0, z[-1]]])
    if height is not None:
        rings[..., 2] = height(rings[..., :2], rings[..., 2])
        ends[:, 2] = height(ends[:, :2], ends[:, 2])
    return _stack(rings, ends[:1], ends[1:])


def circle(radius: float) -> np.ndarray:
    """(n, 2) m, counter-clockwise, about SPACING_M apart."""
    count = 8 * int(np.ceil(2 * np.pi * radius / SPACING_M / 8))
    angle = 2 * np.pi * np.arange(count) / count
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def rectangle(length: float, width: float) -> np.ndarray:
    """(n, 2) m, counter-clockwise, corners kept."""
    x, y = length / 2, width / 2
    return resampled(np.array([[x, -y], [x, y], [-x, y], [-x, -y], [x, -y]]), SPACING_M)[:-1]


def column(radius: float, height: float) -> np.ndarray:
    """Profile of an upright wall with a flat top, in units of the outline and m."""
    corners = np.array([[0.0, 0.0], [radius, 0.0], [radius, height], [0.0, height]])
    path = resampled(corners, SPACING_M)
    return np.column_stack([path[:, 0] / radius, path[:, 1]])


def cylinder() -> Phantom:
    """The paper's first silicone: radius 40 mm, height 80 mm, 29 kPa."""
    vertices, faces = stacked(circle(0.040), column(0.040, 0.080))
    return Phantom("cylinder", "cylinder radius 0.040 height 0.080", vertices, faces, 29e3)


def block() -> Phantom:
    """The paper's second silicone: 105 mm square, 47 mm high, 16 kPa."""
    vertices, faces = stacked(rectangle(0.105, 0.105), column(0.0525, 0.047))
    return Phantom("block", "square block 0.105 x 0.105 x 0.047", vertices, faces, 16e3)


def half_sphere() -> Phantom:
    """The paper's third silicone: a sphere of radius 60 mm cut to a height of 55 mm, 16 kPa."""
    radius, height = 0.060, 0.055
    low = np.arcsin((height - radius) / radius) * -1
    angle = np.linspace(low, np.pi / 2, int(np.ceil(radius * (np.pi / 2 - low) / SPACING_M)) + 1)
    cap = np.column_stack([radius * np.cos(angle), height - radius + radius * np.sin(angle)])
    cap[0, 1], cap[-1] = 0.0, (0.0, height)
    path = np.vstack([resampled(np.array([[0.0, 0.0], cap[0]]), SPACING_M)[:-1], cap])
    profile = np.column_stack([path[:, 0] / cap[0, 0], path[:, 1]])
    vertices, faces = stacked(circle(cap[0, 0]), profile)
    return Phantom("half-sphere", "sphere radius 0.060 cut to height 0.055", vertices, faces, 16e3)


def cushion(height: float, exponent: float, reach: float) -> np.ndarray:
    """Profile whose wall rises and bends over into a cap: (scale)^p + (z / height)^p = 1."""
    angle = np.linspace(0.0, np.pi / 2, 4000)
    path = np.column_stack(
        [reach * np.cos(angle) ** (2 / exponent), height * np.sin(angle) ** (2 / exponent)]
    )
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    wanted = np.linspace(0.0, length[-1], int(np.ceil(length[-1] / SPACING_M)) + 1)
    cap = np.column_stack([np.interp(wanted, length, path[:, k]) for k in (0, 1)])
    cap[-1, 0] = 0.0
    floor = resampled(np.array([[0.0, 0.0], cap[0]]), SPACING_M)[:-1]
    profile = np.vstack([floor, cap])
    profile[:, 0] /= reach
    return profile


def bean() -> Phantom:
    """A kidney 112 mm long with a dent in its side (not convex), 46 mm high, 20 kPa."""
    angle = 2 * np.pi * np.arange(200) / 200
    radius = 1 / np.sqrt((np.cos(angle) / 0.056) ** 2 + (np.sin(angle) / 0.038) ** 2)
    turn = np.angle(np.exp(1j * (angle + np.pi / 2)))
    radius *= 1 - 0.45 * np.exp(-((turn / 0.75) ** 2))
    outline = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    vertices, faces = stacked(outline, cushion(0.046, 3.0, 0.045))
    return Phantom("bean", "kidney 0.111 x 0.065 x 0.046, dent 0.006 deep in one side", vertices, faces, 20e3)


def dome() -> Phantom:
    """A breast-like dome, 120 mm wide and 50 mm high, 12 kPa, with two stiff nodules."""
    vertices, faces = stacked(circle(0.060), cushion(0.050, 2.2, 0.060))
    vertices = vertices.copy()
    vertices[:, 0] += 0.12 * vertices[:, 2] * (vertices[:, 2] / 0.050)
    nodules = (
        Region("upper nodule", (0.014, 0.012, 0.030), 0.008, 6.0),
        Region("deep nodule", (-0.022, -0.016, 0.018), 0.007, 8.0),
    )
    shape = "breast-like dome radius 0.060 height 0.050, leaning"
    return Phantom("dome", shape, vertices, faces, 12e3, regions=nodules)


def wedge() -> Phantom:
    """A wedge 100 mm by 80 mm whose top slopes from 32 mm to 58 mm, 22 kPa."""
    low, high, length = 0.032, 0.058, 0.100

    def slope(xy: np.ndarray, z: np.ndarray) -> np.ndarray:
        top = low + (high - low) * (xy[..., 0] / length + 0.5)
        return z / high * top

    vertices, faces = stacked(rectangle(length, 0.080), column(0.040, high), slope)
    return Phantom("wedge", "wedge 0.100 x 0.080, height 0.032 to 0.058", vertices, faces, 22e3)


def bowl() -> Phantom:
    """A round block, radius 48 mm and height 50 mm, with a spherical dish 18 mm deep in its top
    (not convex).
    """
    radius, height, mouth, deep = 0.048, 0.050, 0.036, 0.018
    ball = (mouth**2 + deep**2) / (2 * deep)
    half = np.arcsin(mouth / ball)
    angle = np.linspace(half, 0.0, int(np.ceil(ball * half / SPACING_M)) + 1)
    dish = np.column_stack([ball * np.sin(angle), height - deep + ball * (1 - np.cos(angle))])
    dish[0], dish[-1, 0] = (mouth, height), 0.0
    corners = np.array([[0.0, 0.0], [radius, 0.0], [radius, height], [mouth, height]])
    path = np.vstack([resampled(corners, SPACING_M), dish[1:]])
    profile = np.column_stack([path[:, 0] / radius, path[:, 1]])
    vertices, faces = stacked(circle(radius), profile)
    return Phantom("bowl", "round block radius 0.048 height 0.050, dish 0.018 deep", vertices, faces, 20e3)


PHANTOMS: dict[str, Callable[[], Phantom]] = {
    "cylinder": cylinder,
    "block": block,
    "half-sphere": half_sphere,
    "bean": bean,
    "dome": dome,
    "wedge": wedge,
    "bowl": bowl,
}
"""Every embedded phantom by name."""

DEFAULT_MODULUS_PA = 20e3
"""Young's modulus of a phantom read from a file, Pa, where none is asked for."""


def phantom(name: str | Path, *, unit: str = "m", up: str = "+z", sink_m: float = 0.0) -> Phantom:
    """A phantom by its name, or the closed surface in a file, z up, its base's middle put on the origin.

    unit, up, sink_m: of a file, as `mechanics.shape.flat_foot.standing` takes them.
    Raises SceneError for an unknown name or what is said of no file, SurfaceError for a surface that is open
    or has no flat foot.
    """
    if str(name) in PHANTOMS:
        if (unit, up, sink_m) != ("m", "+z", 0.0):
            raise SceneError(f"--unit, --up and --sink are for a surface's file; '{name}' is a phantom")
        return PHANTOMS[str(name)]()
    path = Path(name)
    if not is_surface_file(path):
        raise SceneError(
            unknown(str(name), "phantom", PHANTOMS, f", or a closed surface as {', '.join(SUFFIXES)}")
        )
    if not path.is_file():
        raise SceneError(
            f"'{path}' {no_file(path)}: name a phantom ({', '.join(PHANTOMS)}) or a file that is there"
        )
    import trimesh

    stood = standing(read_surface(path, unit), up, sink_m)
    surface = trimesh.Trimesh(stood.vertices, stood.triangles)
    if stood.support_normal[2] < 1:
        surface.apply_transform(trimesh.geometry.align_vectors(stood.support_normal, (0, 0, 1)))
    low, high = surface.bounds
    surface.apply_translation([*-(low + high)[:2] / 2, -float(stood.support_normal @ stood.support_point)])
    for _ in range(8):
        if surface.edges_unique_length.max() <= 2.5 * SPACING_M or len(surface.faces) > 60000:
            break
        surface = surface.subdivide()
    shape = f"surface of {len(surface.faces)} triangles from {path.name}"
    return Phantom(path.stem, shape, surface.vertices, surface.faces, DEFAULT_MODULUS_PA)
