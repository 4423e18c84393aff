"""
Bring your own mesh
===================

A shape that is known needs no exploration: a surface's file (or a trimesh, as here), its unit and a modulus
make a model that can be felt; ``sink_m`` cuts it off flat where it stands.
"""

import numpy as np
import trimesh

import palpate as pp

thumb = trimesh.creation.capsule(height=0.03, radius=0.02)
model = pp.model_of(thumb, 15e3, sink_m=0.008, tip_radius_m=0.004, mesh_size_m=0.010)
print(model)
model.show()

# %%
# Press it on its top and on its flank:

felt = pp.renderer(model, "fem")
tip, middle = thumb.bounds[1, 2], thumb.bounds[:, 2].mean()
top = pp.press(felt, at=(0, 0, tip), depth_m=0.004)
side = pp.press(felt, at=(0.02, 0, middle), direction=(-1, 0, 0), depth_m=0.004)
print(f"top {np.linalg.norm(top.force_at(0.004)):.2f} N, side {np.linalg.norm(side.force_at(0.004)):.2f} N")
side.show()

# %%
# As a command: ``palpate touch thumb.stl --unit mm --sink 0.008 --modulus 15000``.
