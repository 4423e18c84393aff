"""
From a recording to a model that can be felt
============================================

A hand traced the outline of a silicone cylinder and pressed it 42 times; a haptic device logged where its
ball-shaped tip was and with what force it pushed. That is all there is to begin with.
"""

import palpate as pp

recording = pp.read_recording("silicone-1-cylinder")  # embedded; yours is a path
print(recording)
recording.plot()

# %%
# One call turns it into geometry, tetrahedra, a fixed base, Young's modulus with an interval, and the 1D
# models of every press. A test of the silicone by itself gave 29 kPa; the recording does not say so.

made = pp.reconstruct(recording)
print(made)
made.show()

# %%
# The model answers any touch. Here is a press into the middle of the top that the hand never made:

curve = pp.press(made, at=(0, 0, 0.08), depth_m=0.004)
curve.plot()

# %%
# And the recorded path, felt again, against what the sensor read:

replayed = pp.replay(made, recording)
print(replayed)
replayed.plot()
