"""The rigid support: what yields there is the instrument.

While the base is traced (or something rigid is pressed) the tip's centre lies in a plane, a tip radius above
the support. A spring between position sensor and tip puts the reading off that plane by the force over its
stiffness, so a plane fitted to readings with the force as one more column tells the spring before any press
is looked at. Segments of one kind share a plane's height; its tilt is the support's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechanics.frames import tangents
from mechanics.presses import Presses
from mechanics.recording import Recording
from mechanics.samples import runs

KINDS = ("trace", "rigid", "retrace")
BLOCK_S = 0.05
"""Readings are averaged over this long: no hand presses faster, and steps of an encoder average out."""
LEAST_BLOCKS = 30
GROUPS = 10
"""Stretches of time that are left out in turn for the standard error."""
PRESSING = 5.0
"""Of a sample's noise: a force along the support's normal from which the tip touches it."""
OUTLIER = 3.0
"""Robust standard deviations: farther off the plane the tip rides on the object's foot or has lifted."""


@dataclass(frozen=True)
class Rigid:
    """compliance, error: m/N along the support's normal and its standard error. off_m: what is left off the
    plane, robust standard deviation. seconds: of contact that were used. force_n: spread of the force."""

    compliance: float
    error: float
    off_m: float
    seconds: float
    force_n: float


def rigid_of(recording: Recording, presses: Presses, normal: np.ndarray) -> Rigid | None:
    """Read the instrument off its contact with the support; normal (3,): out of the support.

    None where it was touched for too short a time to tell.
    """
    size = max(1, round(BLOCK_S * recording.sample_rate_hz))
    columns, heights, forces = [], [], []
    across, along = tangents(normal)
    for number, kind in enumerate(KINDS):
        for a, b in runs(presses.within(kind, recording.t)):
            blocks = (b - a) // size
            if not blocks:
                continue
            part = slice(a, a + blocks * size)
            x = recording.position[part].reshape(blocks, size, 3).mean(axis=1)
            f = recording.force_on_tool[part].reshape(blocks, size, 3).mean(axis=1) @ normal
            own = np.zeros((blocks, len(KINDS)))
            own[:, number] = 1.0
            columns.append(np.column_stack([-f, x @ across, x @ along, own]))
            heights.append(x @ normal)
            forces.append(f)
    if not columns:
        return None
    a, h, f = np.vstack(columns), np.concatenate(heights), np.concatenate(forces)
    touching = f > PRESSING * presses.noise.raw_n
    if touching.sum() < LEAST_BLOCKS:
        return None
    a, h, f = a[touching], h[touching], f[touching]
    a = a[:, np.abs(a).max(axis=0) > 0]
    a[:, 1:3] -= a[:, 1:3].mean(axis=0)
    h = h - h.mean()
    kept = np.ones(len(h), dtype=bool)
    for _ in range(20):
        found = np.linalg.lstsq(a[kept], h[kept], rcond=None)[0]
        off = h - a @ found
        scale = 1.4826 * float(np.median(np.abs(off[kept]))) + 1e-9
        again = np.abs(off) < OUTLIER * scale
        if (again == kept).all() or again.sum() < LEAST_BLOCKS:
            break
        kept = again
    rows = np.array_split(np.flatnonzero(kept), GROUPS)
    left = [np.concatenate([r for j, r in enumerate(rows) if j != k]) for k in range(GROUPS)]
    each = np.array([np.linalg.lstsq(a[r], h[r], rcond=None)[0][0] for r in left])
    error = np.sqrt((GROUPS - 1) / GROUPS * ((each - each.mean()) ** 2).sum())
    return Rigid(float(found[0]), float(error), scale, float(kept.sum() * BLOCK_S), float(f[kept].std()))
