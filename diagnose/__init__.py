"""Diagnosis: where a simulated touch leaves the measured one, which effect causes it, how far it shrinks.

`pipeline` goes one way: `forward` predicts every press, `instrument` takes off what is the sensor's and the
tool's, `search` fits effects and weighs them, `verdict` says what is named and what to touch next. `apply`,
`calibrate`, `compare`, `explore` and `specimen` use these.
"""

from palpate import (
    mechanics as mechanics,  # it says where compiled kernels are kept, before the first is decorated
)
