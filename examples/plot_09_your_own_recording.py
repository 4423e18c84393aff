"""
Bring your own recording
========================

Any log of where a ball-shaped tip was, and with what force it pushed, will do. Here it is a text file
from a robot: millimetres, seconds, and the force *on the object*. Names of columns are guessed and told;
what cannot be guessed is asked for.
"""

from pathlib import Path
from tempfile import mkdtemp

import numpy as np

import palpate as pp

# a file as another program may have written it
source = pp.read_recording("silicone-1-cylinder")
log = Path(mkdtemp()) / "robot.csv"
columns = np.column_stack([source.t, 1e3 * source.position, -source.force_on_tool])
np.savetxt(log, columns, delimiter=";", header="time;x;y;z;fx;fy;fz", comments="", fmt="%.6g")
print(log.read_text()[:120])

# %%
# Say what the file does not: the tip's radius, the unit of lengths, and on what the force acts.

understood = pp.import_table(
    log, tip_radius_m=source.tip_radius_m, units={"position": "mm"}, force_on="object"
)
print(understood)
understood.plot()

# %%
# Before a model is made of it, it is checked: noise, delay, saturation, clipped or missing samples, ...

print(pp.check(understood.recording))

# %%
# From here on it is a recording like any other: ``pp.reconstruct(understood.recording)``, or
# ``palpate import robot.csv -o REC.csv.gz`` and then ``palpate reconstruct REC.csv.gz -o MODEL``.
