"""What the solver must reproduce: patch test, Hertz, halved mesh and steps, tangent, energy. Figures only."""

from __future__ import annotations

import numpy as np

from palpate.scenes.laboratory.contact import SphereContact
from palpate.scenes.laboratory.mesh import QuadraticMesh, quadratic, refine
from palpate.scenes.laboratory.solid import Solid, SolidMaterial
from palpate.scenes.laboratory.solver import LinearProblem
from palpate.scenes.laboratory.specimen import Fineness, Specimen, build
from palpate.scenes.phantoms import Phantom


def box(length: float, height: float, finest: float, growth: float) -> QuadraticMesh:
    """A square box (mm) on z = 0, graded towards the middle of its top: six tetrahedra, bisected."""
    h = length / 2
    corners = np.array([[x, y, z] for z in (0.0, height) for y in (-h, h) for x in (-h, h)])
    six = [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]]
    tetrahedra = np.array(six)
    top = np.array([0.0, 0.0, height])

    def size(at: np.ndarray) -> np.ndarray:
        far = np.linalg.norm(at - top, axis=1)
        return 1.35 * (finest + growth * np.maximum(far - 1.5 * finest, 0.0))

    points, tetrahedra = refine(corners, tetrahedra, size, lambda middles, half: middles)
    return quadratic(points, tetrahedra, None)


def patch_test(poisson_ratio: float = 0.49) -> float:
    """Greatest residual over greatest internal force of inner nodes under a uniform finite deformation."""
    mesh = box(20.0, 12.0, 4.0, 0.5)
    solid = Solid(mesh, SolidMaterial(len(mesh.cells), poisson_ratio))
    stretch = np.array([[0.12, 0.05, -0.03], [0.02, -0.06, 0.04], [0.01, 0.03, -0.04]])
    force, _, _, _ = solid.evaluate(mesh.points @ stretch.T, solid.new_history(), 0.0, False)
    total = np.zeros_like(mesh.points)
    np.add.at(total, mesh.cells.ravel(), force.reshape(-1, 3))
    shell = np.zeros(len(total), dtype=bool)
    shell[np.unique(np.concatenate([mesh.faces.ravel(), mesh.base.ravel()]))] = True
    return float(np.abs(total[~shell]).max() / np.abs(force).max())


def tangent_error(material: SolidMaterial, solid: Solid, seed: int = 0) -> float:
    """Largest relative difference of the element tangents from central differences of the element forces."""
    rng = np.random.default_rng(seed)
    points = solid.mesh.points
    u = points @ (0.08 * rng.normal(size=(3, 3))) + 0.01 * rng.normal(size=points.shape)
    d, history, step = rng.normal(size=points.shape), solid.new_history(), 1e-5
    _, tangent, _, _ = solid.evaluate(u, history, 0.05, True)
    plus = solid.evaluate(u + step * d, history, 0.05, False)[0]
    minus = solid.evaluate(u - step * d, history, 0.05, False)[0]
    local = d[solid.mesh.cells].reshape(len(solid.mesh.cells), 30)
    exact = np.einsum("eij,ej->ei", tangent, local)
    return float(np.abs((plus - minus) / (2 * step) - exact).max() / np.abs(exact).max())


def hertz_ratio(depth: float = 0.5, radius: float = 50.0, finest: float = 0.5) -> float:
    """Force over Hertz's for a frictionless sphere (mm) on a block at small strain, Poisson's ratio 0.3.

    The contact radius a = sqrt(R d) is a tenth of the sphere's, the block is 300 a wide and 150 a high.
    """
    poisson = 0.3
    contact_radius = np.sqrt(radius * depth)
    length, height = 300 * contact_radius, 150 * contact_radius
    mesh = box(length, height, finest * contact_radius, 0.45)
    solid = Solid(mesh, SolidMaterial(len(mesh.cells), poisson))
    top = np.array([0.0, 0.0, height])
    near = np.linalg.norm(mesh.points[mesh.faces].mean(axis=1) - top, axis=1) < 3 * contact_radius
    contact = SphereContact(mesh.points, mesh.faces[near], radius, 0.0)
    problem = LinearProblem(solid, contact, ~np.repeat(mesh.fixed, 3))
    start = top + [0.0, 0.0, radius]
    state = problem.rest(start)
    for share in (0.3, 0.65, 1.0):
        state = problem.advance(state, start - [0.0, 0.0, share * depth])
    stiffness = 1 / (1 - poisson**2)
    return float(state.force[2] / (4 / 3 * stiffness * np.sqrt(radius) * depth**1.5))


def dent_force(depths: np.ndarray, radius: float = 5.0, finest: float = 3.0, step: float = 0.2) -> np.ndarray:
    """Force (k,) E mm^2 of a sticking sphere at increasing `depths` mm in a large block, small strain, 0.49.

    The block stands for a half-space: 60 radii wide and 40 high. step: longest load step, mm.
    """
    mesh = box(60 * radius, 40 * radius, finest, 0.5)
    top = np.array([0.0, 0.0, 40 * radius])
    near = np.linalg.norm(mesh.points[mesh.faces].mean(axis=1) - top, axis=1) < 2.4 * radius
    contact = SphereContact(mesh.points, mesh.faces[near], radius, None)
    problem = LinearProblem(
        Solid(mesh, SolidMaterial(len(mesh.cells), 0.49)), contact, ~np.repeat(mesh.fixed, 3)
    )
    start = top + [0.0, 0.0, radius]
    state, force, before = problem.rest(start + [0.0, 0.0, 1e-3]), [], 0.0
    for depth in depths:
        for at in np.linspace(before, depth, 1 + int(np.ceil((depth - before) / step - 1e-9)))[1:]:
            state = problem.advance(state, start - [0.0, 0.0, at])
        force.append(float(state.force[2]))
        before = depth
    return np.array(force)


def straight_press(
    phantom: Phantom,
    specimen: Specimen,
    point: np.ndarray,
    normal: np.ndarray,
    depths: np.ndarray,
    fineness: Fineness,
) -> tuple[np.ndarray, np.ndarray]:
    """(normal force (k,) E mm^2, stored energy (k,) E mm^3) of a straight press."""
    problem = build(phantom, specimen, point, travel=0.0, fineness=fineness)
    start = point + specimen.tip_radius * normal
    state = problem.rest(start)
    force, energy = [], []
    for depth in depths:
        state = problem.advance(state, start - depth * normal)
        force.append(float(state.force @ normal))
        energy.append(state.energy)
    return np.array(force), np.array(energy)
