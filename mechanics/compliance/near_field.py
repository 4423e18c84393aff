"""What something stiff close below the surface adds to a touch: felt under the contact, not under the patch.

The load patch is as wide as the mesh bears, wider than the contact of a tip. In a uniform solid that costs
nothing, for the half-space under the same patch is subtracted; but the strain that reaches a nodule a few
millimetres deep depends on the width of the load. What the nodule changes is smooth on the mesh, though,
under a load as narrow as the contact too: the error of a narrow load on wide elements is the same with and
without the nodule and drops out of the difference.

A contact widens as it deepens: a stiff ball whose top lies 4 mm deep adds 26 % to the force of a touch of 0.5
mm and 48 % to one of 4 mm, where a load of one width has 16 and 53. The compliance under the loads of two
depths is met by a compliance and a bend of the dent's law (`BallLaw`), which every reader of a place has.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from palpate.mechanics.compliance.compression import own_compliance
from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.contact.dent import STIFFEST, dent_law, grid
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.plausible import USUAL_TIP_RADIUS_M
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.tetmesh import TetMesh

_OF_CUT = 0.44 / np.sqrt(0.84)
"""Width of the Gaussian that stands for a contact, over the radius at which the sphere cuts the surface's
plane, 0.48: axisymmetric contact solutions over balls 2 to 14 mm deep ask for 0.46 to 0.50 (Hertz's pressure
alone has 1/sqrt(5)); docs/explanation/mechanics.md."""
_USUAL_DEPTH, BALL_DEPTHS = 0.6, (0.3, 0.8)
"""In tip radii: of a contact that stands for all; at which `BallLaw` is exact."""
_MOST_BEND, _MOST_TIMES = 1.2, 4.0

_NEGLIGIBLE = 1e-3  # of the contact's own compliance
_BATCH = 32


class BallLaw(NamedTuple):
    """far: (k, 3, 3) 1/m, to add to the compliance of k places under their patches, unit modulus. bracing:
    (k,) 1/m, to add to TouchSites.bracing: below 0 over a stiff ball, which counts less the wider a contact
    is."""

    far: np.ndarray
    bracing: np.ndarray

    @classmethod
    def none(cls, count: int) -> BallLaw:
        """Of `count` places over no ball."""
        return cls(np.zeros((count, 3, 3)), np.zeros(count))


def contact_width(tip_radius_m: float, depth_in_radii: float = _USUAL_DEPTH) -> float:
    """Width, m, of a Gaussian patch that reaches into the depth as the contact of a tip does."""
    x = min(depth_in_radii, 1.0)
    return _OF_CUT * tip_radius_m * float(np.sqrt(2 * x - x * x))


def surface_softness(
    mesh: TetMesh, surface_ratio: np.ndarray, points: np.ndarray, tip_radius_m: float
) -> np.ndarray:
    """(k,) global modulus over that of the surface under a tip at points (k, 3) m; 1 where it is uniform.

    surface_ratio: (m,) of what lies at the surface (Model.surface_ratio): balls lie inside, a skin is in the
    dent's law.
    """
    softness = 1 / surface_ratio[mesh.touchable_elements]
    if np.abs(softness - 1).max() < 1e-9:
        return np.ones(len(points))
    sampler = PatchSampler(mesh, contact_width(tip_radius_m))
    return np.array([sampler.triangle_mean(point, softness) for point in points])


def ball_law(
    solver: Solver,
    points: np.ndarray,
    normals: np.ndarray,
    patch_width_m: float,
    tip_radius_m: float = USUAL_TIP_RADIUS_M,
    progress: Progress = silent,
) -> BallLaw:
    """What balls below places (k, 3) of unit outward normals (k, 3) add beyond what their patches have of
    them, by depth. Costs eighteen solves a place that feels them, and `solver.plain`."""
    law = BallLaw.none(len(points))
    widths = [contact_width(tip_radius_m, depth) for depth in BALL_DEPTHS]
    felt, soft, (wide, shallow, deep) = _changes(solver, points, (patch_width_m, *widths), progress)
    if len(felt):
        outer = normals[felt, :, None] * normals[felt, None, :]
        along, below = (np.einsum("kij,kij->k", outer, change) for change in (shallow, deep))
        whole, bend = depth_law(along, below, soft, solver.poisson_ratio, tip_radius_m)
        law.far[felt] = deep - wide + (whole - below)[:, None, None] * outer
        law.bracing[felt] = bend / tip_radius_m
    return law


def depth_law(
    shallow: np.ndarray, deep: np.ndarray, softness: np.ndarray, poisson_ratio: float, tip_radius_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """(compliance (k,) 1/m, bend (k,)) by which a touch has the forces at BALL_DEPTHS that compliances (k,)
    of those depths alone would give it."""
    columns = dent_law("linear", poisson_ratio).table.T
    at, c_at, g_at = grid(), *np.ascontiguousarray(columns[[0, 3]])  # else copied at every step of a root
    unit = tip_radius_m / (softness * (1 - poisson_ratio**2))  # of forces over the radius, unit modulus

    def dent(x: np.ndarray, bend: np.ndarray | float = 0.0) -> np.ndarray:
        """Its force over the radius, x in radii."""
        return unit * np.interp(x, at, c_at) * (1 + bend * np.interp(x, at, g_at)) * x**1.5

    def force(change: np.ndarray, depth: float) -> np.ndarray:
        def beyond(x: np.ndarray) -> np.ndarray:
            return x + np.maximum(change * dent(x), -STIFFEST * x / 1.5) - depth

        return dent(_root(beyond, np.zeros(len(change)), np.full(len(change), depth / (1 - STIFFEST))))

    forces = [force(change, depth) for change, depth in zip((shallow, deep), BALL_DEPTHS, strict=True)]

    def bent(i: int, compliance: np.ndarray) -> np.ndarray:
        x = np.maximum(BALL_DEPTHS[i] - compliance * forces[i], 0.05)
        return (forces[i] / dent(x) - 1) / np.interp(x, at, g_at)

    # beyond the shallow one by so many times their difference, the same bend serves both
    sign = np.sign(shallow - deep)
    times = _root(
        lambda t: sign * np.subtract(*(bent(i, shallow + t * (shallow - deep)) for i in (0, 1))),
        np.zeros(len(deep)), np.full(len(deep), _MOST_TIMES),
    )  # fmt: skip
    bend = np.clip(bent(1, shallow + times * (shallow - deep)), -_MOST_BEND, _MOST_BEND)
    most = np.full(len(deep), 1 / (1 - STIFFEST))
    x = _root(lambda x: dent(x, bend) - forces[1], np.zeros(len(deep)), most)
    return (BALL_DEPTHS[1] - x) / forces[1], bend


def _root(function: Callable[[np.ndarray], np.ndarray], low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(k,) where a rising function of (k,) is zero, by halving; an end where it is beyond."""
    for _ in range(45):
        middle = 0.5 * (low + high)
        beyond = function(middle) > 0
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return 0.5 * (low + high)


def _changes(
    solver: Solver, points: np.ndarray, widths: Sequence[float], progress: Progress
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(felt (f,) numbers of the places that feel what varies, softness (f,) of the surface under them,
    (w, f, 3, 3) 1/m): for each width C - soft * (the same of the uniform object), unit modulus.

    softness: one over the modulus ratio of the surface there."""
    ratio = solver.modulus_ratio
    if ratio is None or solver.uniform:
        return np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((len(widths), 0, 3, 3))
    patches = [PatchSampler(solver.mesh, width) for width in widths]
    softness = 1 / ratio[solver.mesh.touchable_elements]
    narrow = PatchSampler(solver.mesh, min(widths))
    soft = np.array([narrow.triangle_mean(point, softness) for point in points])
    felt = np.flatnonzero(_estimate(solver, points, soft, min(widths), max(widths)) > _NEGLIGIBLE)
    changes = np.empty((len(widths), len(felt), 3, 3))
    for start in range(0, len(felt), _BATCH):
        some = slice(start, start + _BATCH)
        for each, patch in zip(changes, patches, strict=True):
            loads = patch.matrix(points[felt[some]])
            plain = own_compliance(solver.plain, loads)
            each[some] = own_compliance(solver, loads) - soft[felt[some], None, None] * plain
        progress("near field", min(1.0, (start + _BATCH) / len(felt)))
    return felt, soft[felt], changes


def _estimate(solver: Solver, points: np.ndarray, soft: np.ndarray, narrow: float, wide: float) -> np.ndarray:
    """(k,) about how much the width of the load matters, over the contact's own compliance.

    First-order energies of the elements that differ from the surface, with Eshelby's factor of a ball, in
    the strain of a force on an incompressible half-space, 3 (F.x)^2 / (2 pi^2 E rho^6) an energy.
    """
    mesh = solver.mesh
    centroids = mesh.points[mesh.tetrahedra[:, :4]].mean(axis=1)
    total = np.empty(len(points))
    for k, (point, softness) in enumerate(zip(points, soft, strict=True)):
        relative = solver.modulus_ratio * softness
        share = mesh.volumes * np.abs(5 * (relative - 1) / (2 * relative + 3))
        squared = ((centroids - point) ** 2).sum(axis=1)
        energy = [squared / (squared + 2 * width**2) ** 3 for width in (narrow, wide)]
        total[k] = 9 / (4 * np.pi**2) * (share @ (energy[0] - energy[1]))
    own = (1 - solver.poisson_ratio**2) / (2 * np.sqrt(np.pi) * narrow)
    return np.abs(total) / own
