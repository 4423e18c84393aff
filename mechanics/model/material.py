"""What an object is made of, in typed parts, and the moduli of a mesh's elements that follow from them.

Moduli of elements are over the object's global modulus. Everything multiplies; what comes out at last is held
within MODULUS_LIMITS.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.mechanics.contact.dent import dent_laws
from palpate.mechanics.disk.schema import FileKey, Schema
from palpate.mechanics.errors import ModelError
from palpate.mechanics.plausible import POISSON_RATIO
from palpate.mechanics.shape.nearest import distance
from palpate.mechanics.shape.tetmesh import TetMesh

UNKNOWN = (float("nan"), float("nan"))
"""An interval that nobody estimated."""

LENGTH = FileKey(low=1e-5, high=1.0, unit="m", required=True)
RATIO = FileKey(low=1e-3, high=1e3, required=True)
PLACE = FileKey(low=-10.0, high=10.0, size=3, unit="m", required=True)
BALL: Schema = {"centre_m": PLACE, "radius_m": LENGTH, "modulus_ratio": RATIO}
GRADIENT: Schema = {"ratio_base": RATIO, "ratio_top": RATIO}
SKIN: Schema = {"thickness_m": LENGTH, "modulus_ratio": RATIO}


@dataclass(frozen=True)
class Ball:
    """A sphere in an object: centre (3,) m in the mesh's frame, radius m, modulus over the object's.

    Raises ModelError for a place that is not finite, or a size or ratio that is not above 0.
    """

    centre_m: tuple[float, float, float]
    radius_m: float
    modulus_ratio: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre_m", tuple(finite("centre_m", self.centre_m, (3,)).tolist()))
        for name in ("radius_m", "modulus_ratio"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))


@dataclass(frozen=True)
class Gradient:
    """Modulus over the object's, linear along the support's normal from the support to the highest node."""

    ratio_base: float
    ratio_top: float

    def __post_init__(self) -> None:
        for name in ("ratio_base", "ratio_top"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))


@dataclass(frozen=True)
class Skin:
    """A layer under the touchable surface: thickness m, modulus over that of what lies within."""

    thickness_m: float
    modulus_ratio: float

    def __post_init__(self) -> None:
        for name in ("thickness_m", "modulus_ratio"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))

    @property
    def stretch_m(self) -> float:
        """m, of the membrane that it is for the whole object; a soft one is none."""
        return self.thickness_m * max(min(self.modulus_ratio, MODULUS_LIMITS[1]) - 1, 0.0)


@dataclass(frozen=True, eq=False)
class ObjectMaterial:
    """SI units. Every ratio is a modulus over the global one; parts that overlap multiply.

    young_modulus_pa: the global modulus e of eq. (13), of what is no part of its own; young_modulus_ci95_pa:
    its 95 % interval, nan where unknown. dent_law: by its name in mechanics.contact.dent. inclusions: by
    name. field: (m,) ratio of each tetrahedron where it is given as numbers, or None. Raises ModelError for
    what is no number or out of range.
    """

    young_modulus_pa: float
    poisson_ratio: float
    young_modulus_ci95_pa: tuple[float, float] = UNKNOWN
    dent_law: str = "linear"
    inclusions: Mapping[str, Ball] = field(default_factory=dict)
    gradient: Gradient | None = None
    skin: Skin | None = None
    field: np.ndarray | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "young_modulus_pa", positive("young_modulus_pa", self.young_modulus_pa))
        nu = float(finite("poisson_ratio", self.poisson_ratio))
        if not POISSON_RATIO.takes(nu):
            raise ModelError(f"poisson_ratio is {nu:g}; it must be {POISSON_RATIO.words}")
        put(self, "poisson_ratio", nu)
        low, high = numbers("young_modulus_ci95_pa", self.young_modulus_ci95_pa, (2,)).tolist()
        if low > high or min(low, high) < 0:
            raise ModelError(f"young_modulus_ci95_pa is [{low:g}, {high:g}]; allowed is 0 <= low <= high")
        put(self, "young_modulus_ci95_pa", (low, high))
        if self.dent_law not in dent_laws():
            raise ModelError(f"dent_law is '{self.dent_law}'; allowed are {', '.join(dent_laws())}")
        put(self, "inclusions", dict(self.inclusions))
        if self.field is not None:
            ratio = np.array(self.field, dtype=float)
            if ratio.ndim != 1 or not (np.isfinite(ratio) & (ratio > 0)).all():
                raise ModelError(f"field {ratio.shape} needs one positive finite value a tetrahedron")
            ratio.setflags(write=False)
            put(self, "field", ratio)


def numbers(name: str, value: Any, shape: tuple[int, ...] = ()) -> np.ndarray:
    """`value` as floats of that shape; raises ModelError where it is none."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        array = None
    if array is None or array.shape != shape:
        raise ModelError(f"{name} is {value!r}; it must be {_words(shape)}")
    return array


def finite(name: str, value: Any, shape: tuple[int, ...] = ()) -> np.ndarray:
    """As `numbers`, and none of them infinite or nan."""
    array = numbers(name, value, shape)
    if not np.isfinite(array).all():
        raise ModelError(f"{name} is {array.tolist()}; it must be {_words(shape)}, finite")
    return array


def positive(name: str, value: Any) -> float:
    """A finite number above 0; raises ModelError where it is none."""
    number = float(finite(name, value))
    if not number > 0:
        raise ModelError(f"{name} is {number:g}; it must be greater than 0")
    return number


def _words(shape: tuple[int, ...]) -> str:
    return f"{shape[0]} numbers" if shape else "a number"


MODULUS_LIMITS = (0.05, 50.0)
"""Of an element over the global modulus: what is harder still feels the same."""

# points that share a tetrahedron evenly: centres of the 20 tetrahedra and holes of a cut in three
_GRID = np.array(
    [[i, j, k, 3 - i - j - k] for i in range(4) for j in range(4 - i) for k in range(4 - i - j)], dtype=float
)
_SAMPLES = (_GRID + 0.25) / 4


def share_inside(
    mesh: TetMesh, centre_m: np.ndarray, radius_m: float, elements: np.ndarray | slice = slice(None)
) -> np.ndarray:
    """(m,) share of each tetrahedron (or of `elements` alone) in a sphere, from 20 points in each."""
    points = points_inside(mesh, elements)
    return (np.linalg.norm(points - centre_m, axis=2) < radius_m).mean(axis=1)


def points_inside(mesh: TetMesh, elements: np.ndarray | slice = slice(None)) -> np.ndarray:
    """(m, 20, 3) m, points that share each tetrahedron (or each of `elements`) evenly."""
    return np.einsum("qc,mcx->mqx", _SAMPLES, mesh.points[mesh.tetrahedra[elements, :4]])


def inclusion_ratio(mesh: TetMesh, centre_m: np.ndarray, radius_m: float, modulus_ratio: float) -> np.ndarray:
    """(m,) modulus over the global one of a sphere `modulus_ratio` times as stiff.

    A tetrahedron that the sphere cuts takes `mixed_ratio` of its share.
    """
    return mixed_ratio(share_inside(mesh, centre_m, radius_m), modulus_ratio)


def mixed_ratio(share: np.ndarray, modulus_ratio: float) -> np.ndarray:
    """Modulus of a matrix (1) that holds a share of balls `modulus_ratio` times as stiff, incompressible.

    After Mori and Tanaka (1973), for stiff balls the lower bound of Hashin and Shtrikman: it keeps the far
    effect of what a tetrahedron holds; the geometric mean has 10 % more of it.
    """
    return 1 + share * (modulus_ratio - 1) / (1 + 0.4 * (1 - share) * (modulus_ratio - 1))


def mixed_of(shares: np.ndarray, ratios: np.ndarray) -> np.ndarray:
    """(m,) as `mixed_ratio`, of shares (m, k) of several materials of moduli (k,) over the matrix's."""
    return 1 / (shares / (ratios + 1.5)).sum(axis=1) - 1.5


def balls_ratio(mesh: TetMesh, balls: Iterable[Ball]) -> np.ndarray:
    """(m,) of all balls: 1 outside; those that overlap multiply. No limits."""
    ratio = np.ones(len(mesh.tetrahedra))
    for ball in balls:
        ratio *= inclusion_ratio(mesh, np.array(ball.centre_m), ball.radius_m, ball.modulus_ratio)
    return ratio


def with_balls(mesh: TetMesh, matrix_ratio: np.ndarray | None, balls: Iterable[Ball]) -> np.ndarray:
    """(m,) of balls in a matrix of ratio (m,), None for 1, within limits."""
    return within_limits(balls_ratio(mesh, balls) * (1.0 if matrix_ratio is None else matrix_ratio))


def height_share(mesh: TetMesh, support_point: np.ndarray, support_normal: np.ndarray) -> np.ndarray:
    """(m,) height of the tetrahedra's centres over the support, as a share of the object's. support_normal:
    (3,) unit, into the object."""
    highest = ((mesh.points - support_point) @ support_normal).max()
    centroid = mesh.points[mesh.tetrahedra[:, :4]].mean(axis=1)
    return ((centroid - support_point) @ support_normal) / highest


def gradient_ratio(gradient: Gradient, height: np.ndarray) -> np.ndarray:
    """(m,) at the tetrahedra's centres, of which `height_share` is (m,)."""
    return gradient.ratio_base + (gradient.ratio_top - gradient.ratio_base) * height


def skin_ratio(mesh: TetMesh, skin: Skin) -> np.ndarray:
    """(m,) modulus over that of the object within: 1 + (modulus_ratio - 1) of each element's share of skin.

    The arithmetic mean, since a skin is stretched along with what it covers.
    """
    points = points_inside(mesh)
    triangles = mesh.touchable_surface[:, :3]
    depth = distance(mesh.points, triangles, points.reshape(-1, 3)).reshape(points.shape[:2])
    return 1 + (skin.modulus_ratio - 1) * (depth < skin.thickness_m).mean(axis=1)


def within_limits(ratio: np.ndarray) -> np.ndarray:
    """The ratio held within MODULUS_LIMITS."""
    return np.clip(ratio, *MODULUS_LIMITS)
