"""
Find the nodule
===============

A breast-like dome of 12 kPa hides a nodule eight times as stiff. A finger that presses along a line over it
feels where it is; here the finger is a scripted press, and the line passes above the nodule.
"""

import matplotlib.pyplot as plt
import numpy as np

import palpate as pp

felt = pp.renderer("nodule", "fem")  # half a minute the first time, then kept
model = pp.load("nodule")

# %%
# Nine presses of 4 mm along a line at y = 12 mm, straight down:

places = np.linspace(-0.030, 0.030, 9)
curves = [pp.press(felt, at=(x, 0.012, 0.06), depth_m=0.004) for x in places]
stiffness = [curve.force_at(0.004) @ model.support.normal / 0.004 for curve in curves]

figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
axes.plot(1e3 * places, stiffness, "o-")
axes.axvline(14, color="0.6", linestyle="--", label="the nodule")
axes.set(xlabel="x, mm", ylabel="force over depth at 4 mm, N/m")
axes.legend()

# %%
# To feel it yourself: ``palpate touch nodule``.
