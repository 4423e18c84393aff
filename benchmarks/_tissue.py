"""Slabs of tissue that nobody made: a random field of the modulus, pressed on a raster.

The solid is solved on elements of its own, finer than the model's, and exactly, with the field in them; what
is drawn is drawn widely: shape, tip, depths, modulus, noise, how far places are alike, layers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from palpate.mechanics.compliance.patch import half_space_compliance
from palpate.mechanics.compliance.sites import LoadPatch, TouchSites, touch_sites, touch_solver
from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.presses.making import PathErrors, of_paths
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh
from palpate.reconstruction.steps.s7_modulus.modulus_field import FieldSites

NU, RATE_HZ, UP = 0.49, 200.0, np.array([0.0, 0.0, 1.0])
FINE_M, COARSE_M = 0.0045, 0.010
_DENT_POINTS = 400


@dataclass(frozen=True)
class Tissue:
    """presses: their first touches as read. model: of one modulus, the slab alone. log_ratio: points (k, 3) m
    to ln of the true modulus over `modulus_pa`. true, law: sites and dent law that made the forces. about:
    what was drawn."""

    presses: Presses
    model: Model
    log_ratio: Callable[[np.ndarray], np.ndarray]
    modulus_pa: float
    true: FieldSites
    law: str
    about: dict[str, float]

    def forces(self, presses: Presses, moved_m: np.ndarray | None = None) -> np.ndarray:
        """(n, 3) N that the slab itself gives to the presses from their first touches as read, or moved (p,)
        m earlier."""
        return self.modulus_pa * self.true.unit_forces(presses, self.law, moved_m)


def tissue(
    seed: int, *, log_sd: float = 0.35, raster: int = 8, touch_error_m: float = 0.0, law: str = "neo-hookean"
) -> Tissue:
    """One slab. raster: presses along each side. touch_error_m: standard error of first touches as read."""
    rng = np.random.default_rng([13, seed])
    spacing = rng.uniform(0.005, 0.009)
    height, tip = rng.uniform(0.020, 0.040), rng.uniform(0.004, 0.006)
    side = (raster - 1) * spacing + 0.030
    length = rng.uniform(0.8, 4.0) * spacing
    modulus, noise = np.exp(rng.uniform(np.log(8e3), np.log(40e3))), rng.uniform(0.002, 0.008)
    log_ratio = _field(rng, length, log_sd, height)
    size = (side, side, height)
    fine, coarse = _slab(size, FINE_M), _slab(size, COARSE_M)
    at = (np.arange(raster) - (raster - 1) / 2) * spacing
    points = np.array([[x, y, height] for x in at for y in at]) + 0.0
    points[:, :2] += rng.normal(0, 0.0003, (len(points), 2))
    normals = np.tile(UP, (len(points), 1))
    sites, dent = _solved(fine, points, normals, tip, log_ratio, rng)
    depth = rng.uniform(0.0015, min(0.005, 0.2 * height), len(points))
    ramp = np.concatenate([np.linspace(-0.001, 1, 120), np.linspace(1, -0.001, 120)])
    into = (ramp[None, :] * depth[:, None]).ravel()
    starts = np.arange(len(points) + 1) * len(ramp)
    centre = points + tip * UP
    travel = -into[:, None] * UP
    force = modulus * dent.repeat(len(ramp))[:, None] * forces_at(
        sites, travel, starts, young_modulus_pa=1.0, tip_radius_m=tip, law=law
    )  # fmt: skip
    read = centre + rng.normal(0, touch_error_m, len(points))[:, None] * UP if touch_error_m else centre
    presses = of_paths(
        starts, centre.repeat(len(ramp), axis=0) + travel, force + rng.normal(0, noise, force.shape), read,
        normals, tip_radius_m=tip, sample_rate_hz=RATE_HZ, errors=PathErrors(touch_error_m, noise),
    )  # fmt: skip
    model = Model(
        coarse.quadratic(), ObjectMaterial(modulus, NU), Support(np.zeros(3), UP), Tool(tip), COARSE_M,
        presses=presses,
    )  # fmt: skip
    drawn = {"spacing_m": spacing, "height_m": height, "length_m": length, "tip_m": tip, "noise_n": noise}
    about = {k: float(v) for k, v in drawn.items()}
    return Tissue(presses, model, log_ratio, float(modulus), FieldSites(sites, dent), law, about)


def _slab(size: tuple[float, float, float], edge_m: float) -> TetMesh:
    x, y, z = (max(3, round(length / edge_m)) for length in size)
    return box_mesh((x, y, z), size)


def _field(
    rng: np.random.Generator, length: float, log_sd: float, height: float
) -> Callable[[np.ndarray], np.ndarray]:
    """Random waves; in half of all cases one layer on top of another stiffness as well."""
    waves, phases = rng.normal(0, 1 / length, (60, 3)), rng.uniform(0, 2 * np.pi, 60)
    thickness, step = rng.uniform(0.15, 0.5) * height, rng.normal(0, log_sd) * (rng.uniform() < 0.5)

    def log_ratio(points: np.ndarray) -> np.ndarray:
        smooth = log_sd * np.sqrt(2 / 60) * np.cos(points @ waves.T + phases).sum(axis=1)
        return smooth + step * 0.5 * (1 + np.tanh((points[:, 2] - height + thickness) / 0.001))

    return log_ratio


def _solved(
    mesh: TetMesh,
    points: np.ndarray,
    normals: np.ndarray,
    tip: float,
    log_ratio: Callable[[np.ndarray], np.ndarray],
    rng: np.random.Generator,
) -> tuple[TouchSites, np.ndarray]:
    """(sites whose far field is over the modulus under each tip, that modulus over the slab's (p,))."""
    ratio = np.exp(log_ratio(mesh.points[mesh.tetrahedra[:, :4]].mean(axis=1)))
    # the far field alone: the width of the load is the patch's
    solver, wide = touch_solver(mesh, NU, ratio), LoadPatch(tip_radius_m=1.0)
    solved = touch_sites(mesh, points, normals, NU, solver=solver, curvature=0.0, patch=wide)
    half = half_space_compliance(UP, NU, solved.patch_width_m)
    ball = rng.normal(size=(_DENT_POINTS, 3))
    ball *= (rng.uniform(size=_DENT_POINTS) ** (1 / 3) / np.linalg.norm(ball, axis=1))[:, None]
    ball[:, 2] = -np.abs(ball[:, 2])
    soft = np.array([np.exp(-log_ratio(p + 0.7 * tip * ball)).mean() for p in points])
    far = (solved.far + (1 - soft)[:, None, None] * half) / soft[:, None, None]
    return replace(solved, far=far), 1 / soft
