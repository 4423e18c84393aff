"""What something stiff close below the surface adds to a touch: felt under the contact, not under the patch.

The load patch is as wide as the mesh bears, wider than the contact of a tip. In a uniform solid that costs
nothing, for the half-space under the same patch is subtracted; but the strain that reaches a nodule a few
millimetres deep depends on the width of the load. What the nodule changes is smooth on the mesh, though,
under a load as narrow as the contact too: the error of a narrow load on wide elements is the same with and
without the nodule and drops out of the difference.
"""

from __future__ import annotations

import numpy as np

from palpate.mechanics.compliance.compression import own_compliance
from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.plausible import USUAL_TIP_RADIUS_M
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.tetmesh import TetMesh

CONTACT_IN_TIP_RADII = 0.44
"""Width of the Gaussian that stands for a contact 0.8 tip radii deep: by it a nodule is felt as in a contact
solution (tops 4, 8, 14 mm deep: 1.05, 1.00, 1.00 of the contrast; docs/explanation/mechanics.md)."""

_NEGLIGIBLE = 1e-3  # of the contact's own compliance
_BATCH = 32


def contact_width(tip_radius_m: float) -> float:
    """Width, m, of a Gaussian patch that reaches into the depth as the contact of a tip does."""
    return CONTACT_IN_TIP_RADII * tip_radius_m


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


def sharpening(
    solver: Solver,
    points: np.ndarray,
    patch_width_m: float,
    tip_radius_m: float = USUAL_TIP_RADIUS_M,
    progress: Progress = silent,
) -> np.ndarray:
    """(k, 3, 3) 1/m: to add to the compliance of places (k, 3) under their patches, unit modulus.

    (C[n, n] - C[s, s]) - (the same of the uniform object) / m, for the contact's width n, the patch's s and
    the modulus ratio m of the surface there. Zero for an object of one modulus, and where first-order
    energies say that it does not matter; elsewhere it costs `solver.plain` and twelve solves a place.
    """
    result = np.zeros((len(points), 3, 3))
    narrow = contact_width(tip_radius_m)
    ratio = solver.modulus_ratio
    if ratio is None or solver.uniform or narrow >= patch_width_m:
        return result
    wide_patch, narrow_patch = (PatchSampler(solver.mesh, width) for width in (patch_width_m, narrow))
    softness = 1 / ratio[solver.mesh.touchable_elements]
    soft = np.array([narrow_patch.triangle_mean(point, softness) for point in points])
    felt = np.flatnonzero(_estimate(solver, points, soft, narrow, patch_width_m) > _NEGLIGIBLE)
    if not len(felt):
        return result
    for start in range(0, len(felt), _BATCH):
        some = felt[start : start + _BATCH]
        near, far = narrow_patch.matrix(points[some]), wide_patch.matrix(points[some])
        result[some] = own_compliance(solver, near) - own_compliance(solver, far)
        uniform = own_compliance(solver.plain, near) - own_compliance(solver.plain, far)
        result[some] -= soft[some, None, None] * uniform
        progress("near field", min(1.0, (start + _BATCH) / len(felt)))
    return result


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
