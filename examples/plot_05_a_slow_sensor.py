"""
Diagnose a slow sensor
======================

A force reading that comes 25 ms late makes any material seem viscous: force runs after depth on the way
in and on the way out alike. A simulation cannot be blamed for that. Here a clean recording is made late, and
the diagnosis is asked what is wrong.
"""

import dataclasses

import numpy as np

import palpate as pp

recording = pp.read_recording("silicone-1-cylinder")
late_s = 0.025
force = np.column_stack([
    np.interp(recording.t - late_s, recording.t, axis) for axis in recording.force_on_tool.T
])  # fmt: skip
slow = dataclasses.replace(recording, force_on_tool=force)

# %%
# The reconstruction corrects a delay by itself, since a late force moves first touches. It is told not to,
# as a simulation would that trusts its sensor.

made = pp.reconstruct(slow, correct_delay=False)
found = pp.diagnose(slow, made, fast=True)
print(found)

# %%
found.plot()
