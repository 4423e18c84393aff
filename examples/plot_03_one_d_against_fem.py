"""
1D models against FEM where nobody pressed
==========================================

Kelvin-Voigt and Hunt-Crossley models fit each press that they were given, and are interpolated between
them. So how good they are depends on where the presses lie; a finite-element model knows one object. Both
are asked about presses that no fit has seen, and about a whole region that was left out.
"""

import matplotlib.pyplot as plt
import numpy as np

import palpate as pp

recording = pp.read_recording("silicone-1-cylinder")
made = pp.load("demo")  # the model of the recording, kept after the first time
compared = pp.compare(recording, made)
print(compared)

# %%
# The error of every held-out press:

compared.plot()

# %%
# The whole top left out, then asked about: 1D models stretch what the side felt like over it. So it goes with
# the middle of the top, and with the band next to the base.

regions = compared.as_json()["regions"]
names = ("fem", "kelvin-voigt", "hunt-crossley")
figure, axes = plt.subplots(figsize=(7, 3.5), layout="constrained")
for k, name in enumerate(names):
    errors = [1e3 * region["rmse_n"][name] for region in regions]
    axes.bar(np.arange(len(regions)) + 0.27 * (k - 1), errors, 0.25, label=name)
axes.set_xticks(range(len(regions)), [region["name"] for region in regions])
axes.set(ylabel="rms force error [mN]")
axes.legend()
