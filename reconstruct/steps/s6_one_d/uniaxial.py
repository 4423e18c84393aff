"""Displacement-force profiles of the presses, as the 1D models are fitted to them."""

from __future__ import annotations

import dataclasses

import numpy as np

from mechanics.presses import Presses
from reconstruct.steps.s1_filter.low_pass import FilterOptions, low_pass


def low_passed(presses: Presses, cutoff_hz: float = FilterOptions.cutoff_hz) -> Presses:
    """The presses net of free air, position and force low-passed without phase shift; points without a time
    stay as they are."""
    net = presses.net
    if net.quasi_static:
        return net
    position, force = np.array(net.position), np.array(net.force)
    for part in net.parts:
        if part.stop - part.start > 3:
            position[part] = low_pass(position[part], net.sample_rate_hz, cutoff_hz)
            force[part] = low_pass(force[part], net.sample_rate_hz, cutoff_hz)
    return dataclasses.replace(net, position=position, force=force)


def profiles(presses: Presses, cutoff_hz: float = FilterOptions.cutoff_hz) -> Presses:
    """`low_passed`, from first touch to loss of touch: depth, rate and push of this view (along the table's
    normals) are u, v and f of equations (1) to (6)."""
    return low_passed(presses, cutoff_hz).window(0.0, 0.0)
