"""A specimen: a phantom as it is on the bench, with everything in the solid, its base and its contact that
matters.

Lengths mm; moduli relative to the matrix. A specimen knows how to become a discrete problem around a touch.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from palpate.scenes.laboratory.contact import SphereContact
from palpate.scenes.laboratory.field import Field, ratio_at
from palpate.scenes.laboratory.mesh import QuadraticMesh, graded_mesh
from palpate.scenes.laboratory.solid import Solid, SolidMaterial
from palpate.scenes.laboratory.solver import Driven, LinearProblem, Problem
from palpate.scenes.laboratory.surface import TriangleSurface
from palpate.scenes.phantoms import Phantom

VERSION = 7
"""Raised whenever solved curves would change."""


Ball = tuple[float, float, float, float, float]
"""x, y, z, radius (mm), modulus ratio."""


@dataclass(frozen=True)
class Specimen:
    """What the solver needs beyond the shape; every field that is not None or 0 departs from the ideal
    model.

    finite: finite strain (neo-Hookean) instead of linear. balls: (x, y, z, radius, ratio) mm. gradient:
    modulus ratios (base, top). skin: (thickness mm, ratio). field: of scenes.laboratory.field.
    base: None bonded; ("unbonded", bonded fraction, direction angle rad); ("springs", k_normal, k_tangential)
    in E per mm. friction: None sticks. fibre: (stiffness over shear modulus, x, y, z). mullins: (r, m).
    plastic: (share, yield strain measure). prony: ((g, tau s), ...).
    """

    poisson_ratio: float = 0.49
    tip_radius: float = 5.0
    finite: bool = False
    stiffening: float = 0.0
    balls: tuple[Ball, ...] = ()
    gradient: tuple[float, float] | None = None
    skin: tuple[float, float] | None = None
    field: Field | None = None
    base: tuple | None = None
    friction: float | None = None
    fibre: tuple[float, float, float, float] | None = None
    mullins: tuple[float, float] | None = None
    plastic: tuple[float, float] | None = None
    prony: tuple[tuple[float, float], ...] = ()

    @property
    def remembers(self) -> bool:
        """Whether a touch leaves a trace in the solid, so that the order of touches matters."""
        return self.mullins is not None or self.plastic is not None

    @property
    def reversible(self) -> bool:
        """Whether the way out of a straight press retraces the way in."""
        return not self.remembers and self.friction is None and not self.prony

    def key(self) -> str:
        """A content key."""
        # what came later is left out where it is not there: solved curves of before keep their keys
        stated = {name: value for name, value in asdict(self).items() if name != "field" or value is not None}
        if self.stiffening:
            stated["stiffening"] = ("exponential or power law", self.stiffening)
        text = json.dumps([VERSION, stated], sort_keys=True, default=str)
        return hashlib.sha256(text.encode()).hexdigest()[:20]


def ball(centre_m: Sequence[float], radius_m: float, ratio: float) -> Ball:
    """A specimen's ball from SI units."""
    x, y, z = (1e3 * v for v in centre_m)
    return (x, y, z, 1e3 * radius_m, ratio)


@dataclass(frozen=True)
class Fineness:
    """How fine the mesh is near a touch: finest mm within `reach` mm, growing by `growth` mm a mm beyond."""

    finest: float = 2.0
    reach: float = 5.0
    growth: float = 0.7


def build(
    phantom: Phantom,
    specimen: Specimen,
    point: np.ndarray,
    *,
    travel: float,
    fineness: Fineness | None = None,
    cache: Path | None = None,
) -> Driven:
    """The discrete problem for touches at `point` (mm, object frame) whose tip strays up to `travel` mm
    sideways.
    """
    fineness = fineness or Fineness()
    if specimen.skin is not None:
        fineness = Fineness(min(fineness.finest, 0.75 * specimen.skin[0]), fineness.reach, 0.5)
    balls = tuple((np.array(b[:3]), b[3]) for b in specimen.balls)
    mesh = graded_mesh(
        phantom,
        point,
        finest=fineness.finest,
        reach=fineness.reach,
        growth=fineness.growth,
        balls=balls,
        cache=cache,
    )
    material = SolidMaterial(len(mesh.cells), specimen.poisson_ratio)
    solid = Solid(mesh, material)
    _place(solid, specimen, phantom)
    near = (
        np.linalg.norm(mesh.points[mesh.faces].mean(axis=1) - point, axis=1)
        < 2.0 * specimen.tip_radius + travel
    )
    contact = SphereContact(mesh.points, mesh.faces[near], specimen.tip_radius, specimen.friction)
    free, springs, floor = _support(mesh, specimen)
    kind = Problem if specimen.finite else LinearProblem
    return kind(solid, contact, free, springs, floor)


def _place(solid: Solid, specimen: Specimen, phantom: Phantom) -> None:
    """Moduli at the Gauss points, and the material's further terms."""
    material = solid.material
    at = solid.gauss_points()
    ratio = np.ones(at.shape[:2])
    if specimen.gradient is not None:
        base, top = specimen.gradient
        ratio *= base + (top - base) * np.clip(at[..., 2] / (1e3 * phantom.height_m), 0, 1)
    if specimen.skin is not None:
        thickness, stiffer = specimen.skin
        surface = TriangleSurface(phantom.vertices * 1e3, phantom.faces)
        off_base = surface.corners[..., 2].max(axis=1) > 1e-6
        bare = TriangleSurface(surface.vertices, surface.faces[off_base])
        depth = bare.nearest(at.reshape(-1, 3))[1].reshape(at.shape[:2])
        # an element larger than the skin takes the share of it that the skin fills
        size = np.cbrt(solid.weights.sum(axis=1))[:, None]
        ratio *= 1 + (stiffer - 1) * np.clip((thickness - depth) / size + 0.5, 0, 1)
    if specimen.field is not None:
        ratio *= ratio_at(specimen.field, at, phantom.vertices * 1e3, phantom.faces)
    for x, y, z, radius, stiffer in specimen.balls:
        inside = np.linalg.norm(at - [x, y, z], axis=2) < radius
        ratio = np.where(inside, ratio * stiffer, ratio)
    material.scale(ratio)
    material.stiffening = specimen.stiffening
    if specimen.fibre is not None:
        direction = np.array(specimen.fibre[1:]) / np.linalg.norm(specimen.fibre[1:])
        material.fibre = np.array([specimen.fibre[0], *direction])
    if specimen.mullins is not None:
        material.mullins = np.array(specimen.mullins)
    if specimen.plastic is not None:
        material.plastic = np.array(specimen.plastic)
    if specimen.prony:
        material.prony = np.array(specimen.prony)


FLOOR = 40.0
"""Stiffness of the support under an unbonded base, E per mm."""


def _support(
    mesh: QuadraticMesh, specimen: Specimen
) -> tuple[np.ndarray, np.ndarray | None, np.ndarray | None]:
    """(free (3 n,), springs (3 n,) or None, one-sided floor springs (3 n,) or None)."""
    bonded = mesh.fixed.copy()
    if specimen.base is None:
        return ~np.repeat(bonded, 3), None, None
    area = np.zeros(len(mesh.points))
    corners = mesh.points[mesh.base[:, :3]]
    size = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    # corners get little and mid-edge nodes much of a quadratic face's area; all weights stay positive
    for k, share in enumerate([1 / 12] * 3 + [1 / 4] * 3):
        np.add.at(area, mesh.base[:, k], share * size)
    if specimen.base[0] == "springs":
        springs = np.zeros((len(mesh.points), 3))
        springs[:, :2] = (area * specimen.base[2])[:, None]
        springs[:, 2] = area * specimen.base[1]
        return np.ones(3 * len(bonded), dtype=bool), springs.ravel(), None
    fraction, angle = specimen.base[1:]
    along = mesh.points[:, :2] @ [np.cos(angle), np.sin(angle)]
    order = np.argsort(along[bonded])
    filled = np.cumsum(area[bonded][order]) / area[bonded].sum()
    limit = along[bonded][order][np.searchsorted(filled, min(fraction, 1.0 - 1e-9))]
    loose = bonded & (along > limit)
    floor = np.zeros((len(mesh.points), 3))
    floor[loose, 2] = FLOOR * area[loose]
    return ~np.repeat(bonded & ~loose, 3), None, floor.ravel()
