"""
A press against Hertz
=====================

Where a tip presses a large block by little, the answer has been known since 1882: a rigid sphere on an
elastic half-space. What is rendered must meet it, and leave it where the block ends or the press grows
deep.
"""

import matplotlib.pyplot as plt
import numpy as np
import trimesh

import palpate as pp

E, NU, RADIUS = 20e3, 0.49, 0.005
block = trimesh.creation.box((0.10, 0.10, 0.05))
block.apply_translation((0, 0, 0.025))
model = pp.model_of(block, E, poisson_ratio=NU, tip_radius_m=RADIUS, mesh_size_m=0.012)
curve = pp.press(model, at=(0, 0, 0.05), depth_m=0.003)
print(curve)

# %%
# Hertz's law for a sphere, and the press:

depth = np.linspace(0, 0.003, 50)
hertz = 4 / 3 * E / (1 - NU**2) * np.sqrt(RADIUS) * depth**1.5
figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
push = curve.force @ curve.normal
axes.plot(1e3 * curve.depth, push, label="rendered")
axes.plot(1e3 * depth, hertz, "--", label="Hertz, half-space")
axes.set(xlabel="depth [mm]", ylabel="force [N]")
axes.legend()

# %%
# The block is not endless, so it gives a little more than a half-space does; Hertz's parabola is not a
# sphere, so it runs ahead where a press is deep.

approach = slice(0, curve.deepest + 1)
for d in (0.0005, 0.001, 0.002):
    law = 4 / 3 * E / (1 - NU**2) * np.sqrt(RADIUS) * d**1.5
    felt = np.interp(d, curve.depth[approach], push[approach])
    print(f"{1e3 * d:.1f} mm: {felt / law:.3f} of Hertz")
