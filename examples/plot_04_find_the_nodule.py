"""
Find the nodule
===============

A breast-like dome of 12 kPa hides a nodule eight times as stiff. A finger that presses along a line over it
feels where it is; here the finger is a scripted press, and the line passes above the nodule.
"""

import matplotlib.pyplot as plt
import numpy as np

import palpate as pp
from palpate.mechanics.model.material import Ball
from palpate.scenes.phantoms import phantom

dome = phantom("dome")
soft = pp.model_of(dome, dome.young_modulus_pa, mesh_size_m=0.014)
nodule = Ball(centre_m=(0.014, 0.012, 0.030), radius_m=0.010, modulus_ratio=8.0)
model = soft.with_material(inclusions={"nodule": nodule})

# %%
# Nine presses of 4 mm along a line at y = 12 mm, straight down, with the nodule and without:

places = np.linspace(-0.030, 0.030, 9)
figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
for label, thing in (("with the nodule", model), ("without", soft)):
    felt = pp.renderer(thing, "fem")
    curves = [pp.press(felt, at=(x, 0.012, 0.06), depth_m=0.004) for x in places]
    stiffness = [curve.force_at(0.004) @ model.support.normal / 0.004 for curve in curves]
    axes.plot(1e3 * places, stiffness, "o-", label=label)
axes.axvline(14, color="0.6", linestyle="--", label="where it is")
axes.set(xlabel="x [mm]", ylabel="force over depth at 4 mm [N/m]")
axes.legend()

# %%
# To feel it yourself, on a finer mesh: ``palpate touch nodule``.
