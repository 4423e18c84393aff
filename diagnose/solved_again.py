"""A lump's effect on every place, solved anew at the optimum: first order finds it, this measures it.

The law of a fit is the first-order change of each place's give; at the fitted lump it is multiplied, place by
place, so that it equals the change of a new factorisation there. Fitting again moves the lump a little; twice
is enough.
"""

from __future__ import annotations

import numpy as np

from diagnose.effects.inclusion import first_order
from diagnose.fields import PATCH_WIDTH_IN_MESH_SIZES, energy_fields
from diagnose.forward import Forward
from mechanics.moduli import inclusion_ratio
from mechanics.patch import PatchSampler
from mechanics.refine import typical_edge
from mechanics.solver import Solver

LIMITS = (0.2, 4.0)


def solve_inclusion(forward: Forward, values: np.ndarray) -> None:
    """Set forward.stages['inclusion_scale'] (p,) for a lump (centre m, radius m, log ratio)."""
    fields = energy_fields(forward)
    mesh = fields.solver.mesh
    ratio = inclusion_ratio(mesh, values[:3], float(values[3]), float(np.exp(values[4])))
    solver = Solver(mesh, forward.nu, ratio)
    t = forward.touches
    sampler = PatchSampler(mesh, PATCH_WIDTH_IN_MESH_SIZES * typical_edge(mesh))
    presses = [int(np.flatnonzero(fields.place == q)[0]) for q in range(len(fields.energy))]
    forces = np.zeros((len(mesh.points), 3, len(presses)))
    for k, press in enumerate(presses):
        nodes, weights = sampler.weights(t.point[press])
        forces[nodes, :, k] = weights[:, None] * t.normal[press]
    give = np.einsum("nik,nik->k", forces, solver.solve(forces))
    exact = (give - fields.energy[:, :, 0, 0].sum(axis=1))[fields.place]
    first = first_order(values, forward)[:, 0, 0]
    known = np.abs(first) > 1e-3 * np.abs(first).max()
    scale = np.where(known, exact / np.where(known, first, 1.0), 1.0)
    forward.stages["inclusion_scale"] = np.clip(scale, *LIMITS)
