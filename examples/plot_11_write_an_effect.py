"""
Write an effect
===============

An effect is what a simulation left out, and one object says all of it: its words, its parameters with
bounds, and what it does to a prediction. Here it is a force sensor that saturates: it never reads more
than a certain force.
"""

import dataclasses
import sys
from types import ModuleType

import matplotlib.pyplot as plt
import numpy as np

import palpate as pp
from palpate.mechanics.effects import registry
from palpate.mechanics.effects.base import Effect, Parameter, Scope
from palpate.mechanics.effects.settings import SHIFTED


def saturate(force, greatest):
    size = np.linalg.norm(force, axis=1, keepdims=True)
    return force * np.minimum(1.0, greatest / np.maximum(size, 1e-12))


EFFECT = Effect(
    name="saturation",
    domain="instrument",
    scope=Scope.PRESS,
    words="the force sensor reads no more than its range",
    parameters=(Parameter("greatest_n", "N", 0.2, 20.0, 20.0, (1.0, 2.0), 0.01),),
    report=lambda values, scene, modulus_pa: {"greatest_n": float(values[0])},
    change=lambda settings, values, scene: settings.read(SHIFTED, lambda f: saturate(f, values[0])),
)

# %%
# In the program an effect is one file, ``mechanics/effects/NAME.py``, and one line in the registry. A
# script can do the same by hand:

module = ModuleType("palpate.mechanics.effects.saturation")
module.EFFECT = EFFECT
sys.modules[module.__name__] = module
registry.NAMES = (*registry.NAMES, "saturation")

# %%
# A recording whose sensor saturates at 1.2 N, and the diagnosis, which now knows the word:

recording = pp.read_recording("silicone-1-cylinder")
clipped = dataclasses.replace(recording, force_on_tool=saturate(recording.force_on_tool, 1.2))
model = pp.load("demo")
found = pp.diagnose(clipped, model, fast=True)
print(found)

figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
found.plot(axes)
