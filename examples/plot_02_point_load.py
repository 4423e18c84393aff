"""
Why a point load misleads
=========================

The paper presses one node of linear tetrahedra. Under a point force an elastic body gives without bound:
the finer the mesh, the softer the same material feels, and the more the modulus that is fitted to a
measured press has to make up for it. A tip has a radius, so its load has a patch. Here one press of 5 mm,
with 20 kPa, is worked out both ways on the same meshes of a block.
"""

import matplotlib.pyplot as plt
import numpy as np

from palpate.mechanics.compliance.sites import touch_sites, touch_solver
from palpate.mechanics.contact.touch import touch_force
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.shape.tetmesh import box_mesh

MODULUS, NU, RADIUS, DEPTH = 20e3, 0.49, 0.005, 0.005
SIDE, HEIGHT = 0.06, 0.03
top, up = np.array([0.0, 0.0, HEIGHT]), np.array([0.0, 0.0, 1.0])

# %%
# A finite tip: the load spreads over the contact, and near the tip the half-space's law of a sphere stands
# in for what no mesh of this size can resolve.


def tip_force(mesh):
    sites = touch_sites(mesh, top[None], up[None], NU, solver=touch_solver(mesh, NU))
    path = np.linspace(0, -DEPTH, 60)[:, None] * up
    return touch_force(path, up, sites.far[0], young_modulus_pa=MODULUS, poisson_ratio=NU,
                       tip_radius_m=RADIUS, law="linear")[-1] @ up  # fmt: skip


# %%
# A point: a unit force on the node in the middle of the top.


def point_force(mesh):
    solver = Solver(mesh, NU)
    node = int(np.argmin(np.linalg.norm(mesh.points - top, axis=1)))
    force = np.zeros((len(mesh.points), 3, 1))
    force[node, :, 0] = up
    return MODULUS * DEPTH / solver.solve(force)[node, 2, 0]


# %%
# The same block, finer and finer.

cells = (3, 4, 6, 8, 10)
sizes, tips, points = [], [], []
for n in cells:
    mesh = box_mesh((2 * n, 2 * n, n), (SIDE, SIDE, HEIGHT))
    sizes.append(1e3 * HEIGHT / n)
    points.append(point_force(mesh))
    tips.append(tip_force(mesh.quadratic()))

figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
axes.plot(sizes, points, "o-", label="point load, linear tetrahedra (the paper)")
axes.plot(sizes, tips, "s-", label="tip of 5 mm")
axes.set(xlabel="edge of an element [mm]", ylabel="force of a press of 5 mm [N]", ylim=(0, None))
axes.invert_xaxis()
axes.legend()

# %%
# What an object feels like must not be a property of the mesh.

for name, forces in (("point load", points), ("finite tip", tips)):
    print(f"{name}: {np.ptp(forces) / np.mean(forces):.0%} between the coarsest and the finest mesh")
