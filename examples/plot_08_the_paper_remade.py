"""
The paper remade
================

Goksel, Jeon, Harders and Szekely press one node of linear tetrahedra with the whole force, inside the
convex hull of the touches. ``method="paper"`` does as they did; the default gives the tip its radius, the
surface its rims and the modulus an interval. The sample is 29 kPa.
"""

import matplotlib.pyplot as plt
import numpy as np

import palpate as pp

recording = pp.read_recording("silicone-1-cylinder")
paper = pp.reconstruct(recording, method="paper", indentation_m=0.004)
print(paper)

# %%
# The modulus of every press, both ways: a point load belongs to its mesh.

model = pp.load("demo")  # the default method's, kept after the first time
figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
own = [paper.model.presses.fits["e_pa"] / 1e3, model.presses.fits["e_pa"] / 1e3]
axes.boxplot([e[np.isfinite(e)] for e in own], tick_labels=["the paper's method", "finite tip"])
axes.axhline(29, color="0.6", linestyle="--", label="the sample")
axes.set(ylabel="modulus of a press [kPa]")
axes.legend()
