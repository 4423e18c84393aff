"""Drake: a deformable body of linear tetrahedra, its base behind a wall condition, and a rigid sphere that is
moved by hand between the steps of its SAP solver.

documented: the step, damping and coarse sphere of its deformable example, on the model's own mesh. best:
edges of a third of the tip's radius under it, a finely meshed sphere, a tenth of the step, 4 ms of damping:
with 1 ms the body rings, and contact is lost in a fifth of the samples (6 % with 4; the same force at rest).
What limits it is the mesh under the tip: with edges of half the radius a shallow press was a sixth harder.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.render.options import BEST, DOCUMENTED
from palpate.render.simulators.base import ScriptedAdapter
from palpate.render.simulators.tunable import EDGES, Tunable, density


@dataclass(frozen=True)
class DrakeSettings:
    """timestep_s; damping_s: stiffness damping of the object; sphere_radii: edges of the sphere's mesh, in
    its radii; edge_radii: edges of the object under the tip, in its radii, inf as the model has them;
    relaxation_s: of the contact, as SAP has it; inf: as documented; density_kg_m3: of the object."""

    timestep_s: float
    damping_s: float
    sphere_radii: float
    edge_radii: float = np.inf
    relaxation_s: float = np.inf
    density_kg_m3: float = 1000.0


SETTINGS = {DOCUMENTED: DrakeSettings(1e-2, 1e-2, 1.0), BEST: DrakeSettings(1e-3, 4e-3, 0.15, 0.35, 0.1)}

TUNABLES = (
    Tunable("sphere_radii", (0.15, 0.3, 0.6, 1.0), "resolution_hint of the sphere, over its radius",
            ("contact_offset", "contact_nodes", "contact_stiffness")),
    EDGES,
    density("set_mass_density of the DeformableBodyConfig"),
    Tunable("damping_s", (1e-3, 2e-3, 4e-3, 1e-2, 3e-2), "set_stiffness_damping_coefficient",
            ("numerical_damping",)),
    Tunable("timestep_s", (1e-3, 2e-3, 5e-3, 1e-2, 2e-2), "time_step of the plant",
            ("time_step", "numerical_damping", "lost_contact")),
    Tunable("relaxation_s", (0.01, 0.03, 0.1, np.inf), "relaxation_time of SAP, of both sides together",
            ("contact_stiffness",), whole=True),
)  # fmt: skip


class Drake(ScriptedAdapter):
    """The adapter."""

    name, extra, units = "drake", "drake", "SI: m, kg, s, N, Pa"
    needs = ("pydrake",)
    scene_module = "palpate.render.simulators.drake_scene"
    settings = SETTINGS
    tunables = TUNABLES
    presses = 12
    cannot = (
        "linear tetrahedra alone, which lock near Poisson's ratio 0.5",
        "an object of two moduli: a body has one",
        "a tip without facets: the sphere is a mesh",
        "a tip that never slides: friction is a number",
    )
    advice = {
        "contact_nodes": "refine the body's mesh under the tip, and the sphere's resolution_hint: "
        "--simulator-settings best",
        "contact_offset": "a smaller resolution_hint of the sphere, whose facets lie inside it: "
        "--simulator-set sphere_radii=0.15",
        "mesh_stiffness": "refine the body's mesh, and take a Poisson's ratio of 0.45 or below",
        "numerical_damping": "lower stiffness_damping_coefficient and the plant's time_step: "
        "--simulator-set damping_s=0.004,timestep_s=0.001",
        "time_step": "a smaller time_step of the plant: --simulator-set timestep_s=0.001",
        "lost_contact": "a smaller time_step, or more stiffness_damping_coefficient, where the body rings",
    }
