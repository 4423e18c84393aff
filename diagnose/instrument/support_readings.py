"""The rigid support: what yields there, or reads sideways there, is the instrument.

While the base is traced (or something rigid is pressed) the tip's centre lies in a plane, a tip radius above
the support. A spring between position sensor and tip puts the reading off that plane by the force over its
stiffness, so a plane fitted to readings with the force as one more column shows the spring before any press
is looked at. Segments of one kind share a plane's height; its tilt is the support's. A play between the two
puts it off by half its width to the side that the tip is on, along each axis of the device that leans out of
the plane: one column more.

Sideways the support answers with friction, against the motion, and the object's foot pushes across it: both
turn with the way around the base. What is left along fixed directions, in proportion to the force along the
support's normal, is that force read into other axes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.instrument.jackknife import all_but_one, covariance
from palpate.mechanics.frames import tangents
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.recording.segments import runs
from palpate.mechanics.recording.side_of_play import leads

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
LEAST_TURNED = 0.1
"""Standard deviation of the side in a play along the normal: with less the plane shows none."""
TILT = 0.01
"""rad, by which the support's normal may be off: as much of its force looks sideways."""


@dataclass(frozen=True)
class Rigid:
    """compliance, error: m/N along the support's normal and its standard error. off_m: what is left off the
    plane, robust standard deviation. seconds: of contact that were used. sideways, sideways_error: (2,)
    shares of the normal force that are read along the support's tangents, and their standard errors. play,
    play_error: m, width of a play, negative where the reading follows the tip, and its standard error."""

    compliance: float
    error: float
    off_m: float
    seconds: float
    sideways: tuple[float, float] = (0.0, 0.0)
    sideways_error: tuple[float, float] = (np.inf, np.inf)
    play: float = 0.0
    play_error: float = np.inf

    @property
    def sideways_z(self) -> float:
        """Standard errors by which the sideways shares differ from none, the normal's own among them."""
        spread = np.hypot(self.sideways_error, TILT)
        return float(np.linalg.norm(np.asarray(self.sideways) / spread))

    @property
    def words(self) -> str:
        """What is read sideways, for a reason."""
        share = float(np.linalg.norm(self.sideways))
        return f"on the rigid support {100 * share:.0f} % of the force along its normal is read sideways"

    @property
    def words_of_play(self) -> str:
        """The play, for a reason."""
        return f"on the rigid support the tip's reading jumps by {1e3 * abs(self.play):.2f} mm where it turns"


@dataclass(frozen=True)
class OnSupport:
    """Means over blocks in which the support is touched. kind: (b,) of KINDS; place: (b, 3) m; force: (b, 3)
    N, on the tool; way: (b, 3), a unit vector; lead: (b, 3), side of the tip in a play (side_of_play)."""

    kind: np.ndarray
    place: np.ndarray
    force: np.ndarray
    way: np.ndarray
    lead: np.ndarray


def rigid_of(recording: Recording, presses: Presses, normal: np.ndarray) -> Rigid | None:
    """Read the instrument off its contact with the support; normal (3,): about the support's, outward.

    Each kind of contact has a plane of its own: the frame may have moved in between. None where the support
    was touched for too short a time.
    """
    rows = on_support(recording, presses, normal)
    if rows is None:
        return None
    kinds, kind = np.unique(rows.kind, return_inverse=True)
    own = np.eye(len(kinds))[kind]
    mean = (own.T @ rows.place) / own.sum(axis=0)[:, None]
    place = rows.place - mean[kind]
    widest = int(np.argmax(own.T @ (place**2).sum(axis=1)))
    for _ in range(2):  # the plane's own normal, whatever the model's support was made from
        across, along = tangents(normal)
        push = rows.force @ normal
        flat = [own, own * (place @ across)[:, None], own * (place @ along)[:, None]]
        lead = rows.lead @ normal
        lead = lead - ((own.T @ lead) / own.sum(axis=0))[kind]
        turned = float(lead.std()) > LEAST_TURNED
        columns = np.column_stack([-push, lead if turned else np.zeros_like(lead), *flat])
        found, errors, off = _fitted(columns, place @ normal, 2)
        tilt = found[2:].reshape(3, -1)[1:, widest]
        normal = normal - tilt[0] * across - tilt[1] * along
        normal = normal / np.linalg.norm(normal)
    push = (rows.force @ normal)[:, None]
    axes = np.stack(tangents(normal), axis=1)
    columns = np.hstack([push, push * (rows.way @ axes), np.ones_like(push)])
    sideways = [_fitted(columns, rows.force @ axis, 1) for axis in axes.T]
    return Rigid(
        compliance=float(found[0]),
        error=float(errors[0]),
        off_m=off,
        seconds=len(push) * BLOCK_S,
        sideways=(float(sideways[0][0][0]), float(sideways[1][0][0])),
        sideways_error=(float(sideways[0][1][0]), float(sideways[1][1][0])),
        play=2 * float(found[1]),
        play_error=2 * float(errors[1]) if turned else np.inf,
    )


def on_support(recording: Recording, presses: Presses, normal: np.ndarray) -> OnSupport | None:
    """Where the support was touched; normal (3,): about its own, outward. None where that is too little."""
    size = max(1, round(BLOCK_S * recording.sample_rate_hz))
    sides, found = leads(recording.t, recording.position), []
    for number, kind in enumerate(KINDS):
        for a, b in runs(presses.within(kind, recording.t)):
            blocks = (b - a) // size
            if blocks < 2:
                continue
            part = slice(a, a + blocks * size)
            place, force, lead = (
                x[part].reshape(blocks, size, 3).mean(axis=1)
                for x in (recording.position, recording.force_on_tool, sides)
            )
            way = np.gradient(place, axis=0)
            way /= np.maximum(np.linalg.norm(way, axis=1), 1e-12)[:, None]
            found.append(np.hstack([np.full((blocks, 1), number), place, force, way, lead]))
    if not found:
        return None
    rows = np.vstack(found)
    rows = rows[rows[:, 4:7] @ normal > PRESSING * presses.noise.raw_n]
    if len(rows) < LEAST_BLOCKS:
        return None
    return OnSupport(rows[:, 0].astype(int), rows[:, 1:4], rows[:, 4:7], rows[:, 7:10], rows[:, 10:])


def _fitted(columns: np.ndarray, target: np.ndarray, asked: int) -> tuple[np.ndarray, np.ndarray, float]:
    """(coefficients (k,), standard errors of the first `asked` by stretches left out, robust scatter of the
    rest) of least squares without outliers. columns: (n, k); target: (n,)."""
    kept = np.ones(len(target), dtype=bool)
    found, scale = np.zeros(columns.shape[1]), 0.0
    for _ in range(20):
        found = np.linalg.lstsq(columns[kept], target[kept], rcond=None)[0]
        off = np.abs(target - columns @ found)
        scale = 1.4826 * float(np.median(off[kept])) + 1e-9
        again = off < OUTLIER * scale
        if (again == kept).all() or again.sum() < LEAST_BLOCKS:
            break
        kept = again
    rows = np.flatnonzero(kept)
    left = [rows[part] for part in all_but_one(len(rows), GROUPS)]
    each = np.array([np.linalg.lstsq(columns[r], target[r], rcond=None)[0][:asked] for r in left])
    return found, np.sqrt(np.diag(covariance(each))), scale
