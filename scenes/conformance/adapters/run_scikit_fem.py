"""scikit-fem: linear tetrahedra, small strains, statics; spheres on nodes by a penalty with friction."""

import sys

import numpy as np
import skfem
from kit_files import run
from scipy.sparse import csc_matrix, linalg
from skfem.models.elasticity import lame_parameters, linear_elasticity

PENALTY, MISSED_M, NEAR_RADII = 10.0, 1e-8, 0.45  # spring over stiffness; misfit; reach of a foot
ELEMENT = skfem.ElementTetP1()  # by SciPy's factorisation ElementTetP2 takes minutes a body


def condensed(body, physics, feet, radius):
    """(nodes (n, 3) m that may touch, their compliance (3 n, 3 n) m/N)."""
    mesh = skfem.MeshTet(body["points"].T, body["tetrahedra"].astype(np.int64).T)
    basis = skfem.Basis(mesh, skfem.ElementVector(ELEMENT))
    elastic = linear_elasticity(*lame_parameters(physics["young_modulus_pa"], physics["poisson_ratio"]))
    stiffness, where = csc_matrix(elastic.assemble(basis)), basis.doflocs
    free = np.flatnonzero(where[2] > 1e-9)  # the base is held
    surface = basis.get_dofs(mesh.boundary_facets()).flatten()
    surface = surface[np.lexsort((surface, *np.round(where[:, surface], 9)))].reshape(-1, 3)
    far = np.linalg.norm(where[:, surface[:, 0]].T[:, None] - feet, axis=2).min(axis=1)
    near = surface[far < NEAR_RADII * radius]
    loads = np.zeros((stiffness.shape[0], near.size))
    loads[near.ravel(), np.arange(near.size)] = 1.0
    fast = {"permc_spec": "MMD_AT_PLUS_A", "options": {"SymmetricMode": True}}
    loads[free] = linalg.splu(stiffness[free][:, free], **fast).solve(loads[free])
    return where[:, near[:, 0]].T, loads[near.ravel()]


def springs(relative, anchor, held, spring, radius, mu):
    """(forces (n, 3) N on nodes at `relative` to a centre, slopes (n, 3, 3)); anchor: where they hold on."""
    distance = np.linalg.norm(relative, axis=1)[:, None]
    n, deep = relative / distance, np.maximum(radius - distance, 0.0)
    across = np.eye(3) - n[:, :, None] * n[:, None]
    pull = -spring * held[:, None] * np.einsum("cij,cj->ci", across, relative - anchor)
    size = np.maximum(np.linalg.norm(pull, axis=1), 1e-15)[:, None]
    share, to = np.minimum(1.0, mu * spring * deep / size), pull / size
    slope = (deep / distance - share * held[:, None])[..., None] * across + across - np.eye(3)
    turned = share[..., None] * to[:, :, None] * to[:, None] - mu * to[:, :, None] * n[:, None]
    slope = (slope + (share < 1)[..., None] * turned) * (deep > 0)[..., None]
    return (spring * deep * n + share * pull) * (deep > 0), spring * slope


def press(body, physics, t, centres):
    """(n, tips, 3) N. Raises ArithmeticError where springs and body find no balance."""
    radius, mu, tips = physics["tip_radius_m"], physics["friction"], range(centres.shape[1])
    apart = np.linalg.norm(body["points"] - centres[0][:, None], axis=2)
    points, compliance = condensed(body, physics, feet := body["points"][apart.argmin(axis=1)], radius)
    whose = np.linalg.norm(points[:, None] - feet, axis=2).argmin(axis=1)
    spring, force, u = PENALTY / np.median(np.diag(compliance)), np.zeros(centres.shape), 0 * points
    anchor, held = np.zeros_like(points), np.zeros(len(points), bool)
    for k, at in enumerate(centres):
        for tried in range(200):
            f, slope = springs(points + u - at[whose], anchor, held, spring, radius, mu)
            missed = u.ravel() - compliance @ f.ravel()
            if np.abs(missed).max() < MISSED_M:
                break
            own = np.repeat(f.any(axis=1), 3)  # the others follow from those that press
            gives = compliance[:, own].reshape(len(own), -1, 3)
            moved = np.einsum("anj,njk->ank", gives, slope[own[::3]]).reshape(len(own), -1)
            step = missed + moved @ np.linalg.solve(np.eye(own.sum()) - moved[own], missed[own])
            share = min((1.0, 0.5, 0.2, 0.1)[tried // 10 % 4], 3e-4 / np.abs(step).max())
            u = u - share * step.reshape(u.shape)
        else:
            raise ArithmeticError(f"no balance at {t[k]:g} s: {np.abs(missed).max():.1g} m are left")
        relative = points + u - at[whose]
        n, slid = relative / np.linalg.norm(relative, axis=1)[:, None], (relative - anchor) * held[:, None]
        slid -= np.einsum("ni,ni->n", slid, n)[:, None] * n
        most = mu * np.einsum("ni,ni->n", f, n) / spring
        back = np.minimum(1.0, most / np.maximum(np.linalg.norm(slid, axis=1), 1e-15))
        anchor, held = relative - slid * back[:, None], f.any(axis=1)
        force[k] = [-f[whose == tip].sum(axis=0) for tip in tips]
    return force


if __name__ == "__main__":
    sys.exit(run(press))
