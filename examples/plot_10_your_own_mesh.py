"""
Bring your own mesh
===================

A shape that is known needs no exploration: a surface's file (or a trimesh, as here), its unit and a modulus
make a model that can be felt.
"""

import numpy as np
import trimesh

import palpate as pp

thumb = trimesh.creation.capsule(height=0.03, radius=0.02)
thumb.apply_translation((0, 0, 0.012))
thumb = thumb.slice_plane((0, 0, 0), (0, 0, 1), cap=True)  # it stands flat on its support
model = pp.model_of(thumb, 15e3, tip_radius_m=0.004, mesh_size_m=0.008)
print(model)
model.show()

# %%
# Press it on its top and on its flank:

felt = pp.renderer(model, "fem")
top = pp.press(felt, at=(0, 0, 0.07), depth_m=0.004)
side = pp.press(felt, at=(0.02, 0, 0.02), direction=(-1, 0, 0), depth_m=0.004)
print(f"top {np.linalg.norm(top.force_at(0.004)):.2f} N, side {np.linalg.norm(side.force_at(0.004)):.2f} N")
side.show()

# %%
# As a command: ``palpate touch thumb.stl --unit mm --modulus 15000``.
