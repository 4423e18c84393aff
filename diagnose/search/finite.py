"""How large finite strain must be here: known physics without a parameter, so its size follows from the
depth."""

from __future__ import annotations

import numpy as np

from diagnose.forward.prediction import Forward
from diagnose.search.fit import Fit, settings_of

# Share of the force by which full three-dimensional solves leave small-strain elasticity, against depth over
# tip radius: fitted to labelled recordings, 1.4 % (rms) at 3-4 mm and 6 % at 4-8 mm with a tip of 5 mm.
COEFFICIENT = 0.032
EXPONENT = 2.4


def predicted_size(forward: Forward, found: Fit) -> float:
    """N rms over contact samples: what finite strain is expected to change in these presses."""
    t = forward.touches
    depth = np.clip(t.travel[:, 0] + found.likeliest[t.press], 0, None) / forward.tip_radius
    force = np.linalg.norm(
        forward.predict(settings_of(forward, found.effects, found.values, found.likeliest)), axis=1
    )
    change = COEFFICIENT * depth**EXPONENT * force
    return float(np.sqrt((change[t.counted] ** 2).mean()))
