"""
A force-response test for pytest
================================

A model that people feel is worth a test: that the top gives as it did last week, that a change of material
is felt where it should be. ``palpate.testing`` brings a fixture; here the same call is made by hand.
"""

from pathlib import Path
from tempfile import mkdtemp

import trimesh

import palpate as pp

block = trimesh.creation.box((0.06, 0.06, 0.03))
folder = Path(mkdtemp()) / "my-model"
pp.model_of(block, 20e3, mesh_size_m=0.012).save(folder)
curve = pp.press(folder, at=(0, 0, 0.015), depth_m=0.004)
curve.plot()

# %%
# In a test file::
#
#     from palpate.testing import press_model
#
#     def test_top_is_soft(press_model):
#         curve = press_model("my-model", at=(0, 0, 0.015), depth_m=0.004)
#         assert 0.6 < curve.force_at(0.004)[2] < 0.67

force = curve.force_at(0.004)
print(force)
assert 0.6 < force[2] < 0.67
