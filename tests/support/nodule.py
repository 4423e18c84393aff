"""A fine reference that shares no code with mechanics: a sphere on the axis of a cylinder with a nodule.

Axisymmetric small-strain elasticity in scikit-fem: quadratic triangles that follow the nodule's boundary,
0.25 mm under the tip. The tip is rigid and does not stick. The surface within some radius is given the
sphere's profile; of all radii the true contact is the one with the greatest force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse.linalg import splu
from scipy.spatial import Delaunay
from skfem import Basis, BilinearForm, ElementTriP2, ElementVector, MeshTri

from palpate.mechanics.compliance.sites import LoadPatch, touch_sites, touch_solver
from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.model.material import Ball

from .sample_shapes import sample_mesh

NU, TIP, UP = 0.49, 0.005, np.array([0.0, 0.0, 1.0])


@BilinearForm
def _elasticity(u, v, w):
    r = w.x[0]
    nu = w.poisson_ratio
    lam, mu = w.modulus * nu / ((1 + nu) * (1 - 2 * nu)), w.modulus / (2 * (1 + nu))
    hoop_u, hoop_v = u[0] / r, v[0] / r
    spread_u = u.grad[0, 0] + u.grad[1, 1] + hoop_u
    spread_v = v.grad[0, 0] + v.grad[1, 1] + hoop_v
    shear = (u.grad[0, 1] + u.grad[1, 0]) * (v.grad[0, 1] + v.grad[1, 0])
    straight = u.grad[0, 0] * v.grad[0, 0] + u.grad[1, 1] * v.grad[1, 1] + hoop_u * hoop_v
    return (lam * spread_u * spread_v + mu * (2 * straight + shear)) * 2 * np.pi * r


def graded(fine: float, until: float, growth: float, most: float, end: float) -> np.ndarray:
    """0 to `end` in steps of `fine` up to `until`, then growing up to `most`."""
    x, step = [0.0], fine
    while x[-1] < end:
        if x[-1] > until:
            step = min(step * growth, most)
        x.append(x[-1] + step)
    return np.array(x) * end / x[-1]


def section(
    radius: float, height: float, centre: float, nodule: float, fine: float, seed: int = 0
) -> tuple[MeshTri, np.ndarray]:
    """(triangles of the half section r, z in m, whether each lies in the nodule); its centre is at z."""
    rng = np.random.default_rng(seed)
    r = graded(fine, 0.008, 1.08, 0.002, radius)
    z = height - graded(fine, 0.006, 1.08, 0.002, height)
    grid = np.stack(np.meshgrid(r, z, indexing="ij"), -1)
    step = np.stack(np.meshgrid(np.gradient(r), np.abs(np.gradient(z)), indexing="ij"), -1)
    moved = grid + 0.05 * step * rng.uniform(-1, 1, grid.shape)  # four corners on a circle would be ambiguous
    grid[1:-1, 1:-1] = moved[1:-1, 1:-1]
    points, spacing = grid.reshape(-1, 2), step.reshape(-1, 2).max(axis=1)
    away = np.abs(np.linalg.norm(points - [0, centre], axis=1) - nodule)
    angle = np.linspace(-np.pi / 2, np.pi / 2, 1 + int(np.ceil(np.pi * nodule / 0.0005)))
    circle = np.stack([nodule * np.cos(angle), centre + nodule * np.sin(angle)], axis=1)
    circle[[0, -1], 0] = 0.0
    points = np.vstack([points[away > 0.6 * np.maximum(spacing, 0.0005)], circle])
    cells = Delaunay(points).simplices
    p = points[cells]
    edges = p[:, 1:] - p[:, :1]
    area = np.abs(np.linalg.det(edges)) / 2
    cells = cells[area > 1e-5 * np.median(area)]
    inside = np.linalg.norm(points[cells].mean(axis=1) - [0, centre], axis=1) < nodule
    return MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T)), inside


@dataclass(frozen=True)
class AxisPress:
    """A press on the axis of a cylinder, its base bonded, over a nodule on that axis. Lengths m."""

    depth_m: float
    depth_of_centre_m: float
    nodule_radius_m: float
    modulus_ratio: float
    radius_m: float = 0.04
    height_m: float = 0.08
    tip_radius_m: float = 0.005
    poisson_ratio: float = 0.49

    def force(self, fine_m: float = 0.25e-3) -> float:
        """N, for unit modulus of the rest; fine_m: elements under the tip."""
        centre = self.height_m - self.depth_of_centre_m
        mesh, inside = section(self.radius_m, self.height_m, centre, self.nodule_radius_m, fine_m)
        basis = Basis(mesh, ElementVector(ElementTriP2()))
        modulus = np.where(inside, self.modulus_ratio, 1.0)[:, None] * np.ones_like(basis.dx)
        matrix = _elasticity.assemble(basis, modulus=modulus, poisson_ratio=self.poisson_ratio).tocsc()
        x = basis.doflocs
        vertical = np.zeros(basis.N, dtype=bool)
        vertical[np.concatenate([basis.nodal_dofs[1], basis.facet_dofs[1]])] = True
        held = (x[1] < 1e-12) | ((x[0] < 1e-12) & ~vertical)
        free = np.flatnonzero(~held)
        reach = np.sqrt(self.tip_radius_m * self.depth_m)
        top = np.flatnonzero(vertical & (x[1] > self.height_m - 1e-12) & (x[0] <= 1.05 * reach))
        place = np.searchsorted(free, top)
        loads = np.zeros((len(free), len(top)))
        loads[place, np.arange(len(top))] = 1.0
        compliance = splu(matrix[free][:, free]).solve(loads)[place]
        sunk = self.depth_m - self.tip_radius_m + np.sqrt(self.tip_radius_m**2 - x[0, top] ** 2)
        forces = []
        for share in np.linspace(0.7, 1.05, 15):
            under = x[0, top] <= share * reach
            forces.append(np.linalg.solve(compliance[np.ix_(under, under)], sunk[under]).sum())
        return float(max(forces))


def presses_on_axis(solver: Solver, height_m: float, depths_m: np.ndarray) -> np.ndarray:
    """(k,) N, for unit modulus: force at depths (k,) m, ascending, of a press at the middle of the top."""
    point = np.array([[0.0, 0.0, height_m]])
    sites = touch_sites(
        solver.mesh, point, UP[None], NU, solver=solver, curvature=0.0, patch=LoadPatch(balls=True)
    )
    path = -np.unique(np.concatenate([np.linspace(0, depths_m[-1], 80), depths_m]))[:, None] * UP
    force = forces_at(
        sites, path, np.array([0, len(path)]), young_modulus_pa=1.0, tip_radius_m=TIP, law="linear"
    )
    return np.interp(depths_m, -path[:, 2], force[:, 2])


def felt(press: AxisPress, depths_m: Sequence[float], mesh_size_m: float = 0.01) -> dict[str, np.ndarray]:
    """At depths (k,) m, ascending: contrast (the force over that without the nodule, less 1) on the paper's
    cylinder, linear dent law, beside the reference's; and the force without the nodule over the
    reference's."""
    mesh, depths = sample_mesh("cylinder", mesh_size_m), np.array(depths_m)
    plain = presses_on_axis(touch_solver(mesh, NU), press.height_m, depths)
    place = (0.0, 0.0, press.height_m - press.depth_of_centre_m)
    ball = Ball(place, press.nodule_radius_m, press.modulus_ratio)
    stiff = presses_on_axis(touch_solver(mesh, NU, balls=[ball]), press.height_m, depths)
    known = np.array([[replace(press, depth_m=depth, modulus_ratio=ratio).force()
                       for ratio in (1.0, press.modulus_ratio)] for depth in depths])  # fmt: skip
    return {
        "contrast": stiff / plain - 1,
        "reference": known[:, 1] / known[:, 0] - 1,
        "plain_force_over_reference": plain / known[:, 0],
    }
