"""Newton: a soft mesh of linear tetrahedra in vertex block descent (VBD), its base without mass (which holds
it), and a kinematic sphere.

documented: a sixtieth of a second in ten steps, as in its soft-body examples, on the model's own mesh. best:
edges of half the tip's radius under it, more sweeps a step; the contact is what still converges, so it gives.
That is not refined until the force stands still: a light press is a third too hard (`Newton.cannot`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.render.options import BEST, DOCUMENTED
from palpate.render.simulators.base import ScriptedAdapter
from palpate.render.simulators.tunable import EDGES, Tunable, density

POISSON_LIMIT = 0.45
"""Beyond it linear tetrahedra lock, and the sweeps do not converge."""


@dataclass(frozen=True)
class NewtonSettings:
    """timestep_s; sweeps: of the solver, a step; contact_n_per_m: of one contact; skin_m: what keeps surfaces
    apart (a particle's radius), by which the sphere is led farther out; damping_s: of the elasticity;
    edge_radii: edges under the tip, in its radii, inf as the model has them; density_kg_m3: of the object."""

    timestep_s: float
    sweeps: float
    contact_n_per_m: float
    skin_m: float = 1e-4
    damping_s: float = 1e-9
    edge_radii: float = np.inf
    density_kg_m3: float = 1000.0


SETTINGS = {DOCUMENTED: NewtonSettings(1 / 600, 10, 1e3), BEST: NewtonSettings(1e-3, 20, 3e3, edge_radii=0.5)}

TUNABLES = (
    Tunable("contact_n_per_m", (30.0, 100.0, 300.0, 1e3, 3e3, 1e4), "soft_contact_ke, and ke of the sphere",
            ("contact_stiffness", "tunnelling")),
    Tunable("sweeps", (5, 10, 20, 40, 80), "iterations of SolverVBD", ("mesh_stiffness", "time_step"),
            whole=True, dear=True),
    EDGES,
    density("density of add_soft_mesh"),
    Tunable("timestep_s", (5e-4, 1e-3, 1 / 600, 4e-3, 8e-3), "the step",
            ("time_step", "numerical_damping", "lost_contact")),
    Tunable("damping_s", (1e-9, 1e-4, 1e-3, 1e-2, 3e-2), "k_damp of add_soft_mesh", ("numerical_damping",)),
    Tunable("skin_m", (1e-5, 1e-4, 3e-4, 1e-3), "particle_radius", ("contact_offset",)),
)  # fmt: skip


class Newton(ScriptedAdapter):
    """The adapter."""

    name, extra, units = "newton", "newton", "SI in single precision: m, kg, s, N, Pa"
    needs = ("newton", "warp")
    scene_module = "palpate.render.simulators.newton_scene"
    settings = SETTINGS
    tunables = TUNABLES
    poisson_limit = POISSON_LIMIT
    presses = 12
    cannot = (
        "a light press: at its best 0.5 mm into a half-space is 1.35 of Hertz's force, 1 mm 1.26",
        "linear tetrahedra alone: they lock near Poisson's ratio 0.5, so it is 0.45 at most",
        "a hard contact: its spring (soft_contact_ke) diverges from some 1e4 N/m on",
        "a tip that never slides: friction is a number",
    )
    advice = {
        "contact_stiffness": "a larger soft_contact_ke, as far as it converges, on a finer mesh (more "
        "contacts side by side): --simulator-settings best",
        "contact_nodes": "refine the mesh under the tip, and keep enable_rigid_soft_full_surface_contact: "
        "--simulator-settings best",
        "contact_offset": "particle_radius is what keeps surfaces apart: take 1e-4, and lead the tip farther "
        "out by it",
        "mesh_stiffness": "refine the mesh, take more iterations of SolverVBD, and a Poisson's ratio of 0.45 "
        "or below",
        "numerical_damping": "k_damp=0 and a smaller step: --simulator-set timestep_s=0.001",
        "time_step": "a smaller step, more iterations of SolverVBD: "
        "--simulator-set timestep_s=0.001,sweeps=20",
        "lost_contact": "a larger soft_contact_gap, a smaller step",
    }
