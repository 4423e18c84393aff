"""
1D models against FEM where nobody pressed
==========================================

Kelvin-Voigt and Hunt-Crossley models fit each press that they were given, and are interpolated between
them. So how good they are depends on where the presses lie; a finite-element model knows one object. Both
are asked about presses that no fit has seen, and about a whole region that was left out.
"""

import palpate as pp

recording = pp.read_recording("silicone-1-cylinder")
made = pp.load("silicone-1")  # the model of the recording, kept after the first time
compared = pp.compare(recording, made)
print(compared)

# %%
# The error of every held-out press:

compared.plot()

# %%
# The whole top left out, then asked about: 1D models stretch what the side felt like over it.

for region in compared.as_json()["regions"]:
    print(region["name"], {name: f"{error:.3f} N" for name, error in region["rmse_n"].items()})
