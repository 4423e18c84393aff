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

Traced once more, the base shows how far the object, or the frame that it is read in, moved in between. A
surface that is fitted to the presses hides a move: it stands where it was pressed. Two tracings of one base
do not: the first, moved as the object was, must lie on the second, in height as well as around the foot.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from palpate.mechanics.frames import tangents
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.recording.segments import runs
from palpate.mechanics.recording.side_of_play import leads
from palpate.mechanics.statistics import all_but_one, jackknife_covariance

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
_AROUND_M = 0.01
"""Of a place on the first tracing, whose points say how the outline runs there."""
_ROUNDS = 30
_TURNED, _OFF_M = 0.03, 0.5e-3
"""rad, m: how far an object turns on its base, where that is round and shows nothing of it, against how far
the outline is off over a stretch."""
_STRETCH = 6
"""Blocks of a stretch: a hand leans in and out once or twice a second."""


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
    return found, np.sqrt(np.diag(jackknife_covariance(each))), scale


@dataclass(frozen=True)
class Move:
    """What carries the first tracing onto the second: a turn, a rotation vector (3,) rad about `centre`, and
    a shift (3,) m, device frame. error: (6, 6) covariance of both, shift first."""

    shift: np.ndarray
    turn: np.ndarray
    centre: np.ndarray
    error: np.ndarray

    def along(self, point: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """((p,) m by which places (p, 3) on the object went along their normals, (p, p) covariance)."""
        arm = np.cross(point - self.centre, normal)
        columns = np.hstack([normal, arm])
        return columns @ np.concatenate([self.shift, self.turn]), columns @ self.error @ columns.T


def move_of(recording: Recording, presses: Presses, normal: np.ndarray, centre: np.ndarray) -> Move | None:
    """Read the move off the two tracings; None where one of them is missing or too short.

    normal: (3,) of the support, outward. centre: (3,) m, what a turn is about.
    """
    rows = on_support(recording, presses, normal)
    if rows is None:
        return None
    first, again = (rows.place[rows.kind == KINDS.index(k)] - centre for k in ("trace", "retrace"))
    if min(len(first), len(again)) < LEAST_BLOCKS:
        return None
    axes = np.vstack([*tangents(normal), normal])
    first, again = first @ axes.T, again @ axes.T
    found = _carried(first, again)
    without_first = [_carried(first[p], again, found) for p in all_but_one(len(first), GROUPS)]
    without_again = [_carried(first, again[p], found) for p in all_but_one(len(again), GROUPS)]
    error = jackknife_covariance(np.array(without_first)) + jackknife_covariance(np.array(without_again))
    both = np.kron(np.eye(2), axes.T)
    shift, turn = (both @ found).reshape(2, 3)
    return Move(shift, turn, centre, both @ error @ both.T)


def _carried(first: np.ndarray, again: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
    """(6,) shift and turn that carry points (k, 3) of one tracing onto another's (n, 3), z along the normal:
    iterated closest points on the lines of the outline (Chen and Medioni 1992), without what is far off."""
    tree = cKDTree(first[:, :2])
    across = np.array([_across(first[near, :2]) for near in tree.query_ball_point(first[:, :2], _AROUND_M)])
    height = np.linalg.lstsq(np.column_stack([np.ones(len(first)), first[:, :2]]), first[:, 2], rcond=None)[0]
    move = np.zeros(6) if start is None else start.copy()
    if start is None:
        move[:3] = np.median(again, axis=0) - np.median(first, axis=0)
    for k in range(_ROUNDS):
        back = Rotation.from_rotvec(move[3:]).inv().apply(again - move[:3])
        _, at = tree.query(back[:, :2])
        flat = ((back[:, :2] - first[at, :2]) * across[at]).sum(axis=1)
        over = back[:, 2] - np.column_stack([np.ones(len(back)), back[:, :2]]) @ height
        side = np.column_stack([across[at], np.zeros(len(at))])
        up = np.broadcast_to([0.0, 0.0, 1.0], back.shape)
        columns = np.vstack([np.hstack([n, np.cross(back, n)]) for n in (side, up)])
        off = np.concatenate([flat, over])
        limit = 4 * max(_OFF_M, 1e-3 * (10 - k))
        weight = (np.abs(off) < limit).astype(float)
        system = (columns * weight[:, None]).T @ columns
        held = _STRETCH * (_OFF_M / _TURNED) ** 2
        system[5, 5] += held
        wanted = (columns * weight[:, None]).T @ off
        wanted[5] -= held * move[5]
        step = np.linalg.solve(system, wanted)
        turned = Rotation.from_rotvec(move[3:])
        move[:3] += turned.apply(step[:3])
        move[3:] = (turned * Rotation.from_rotvec(step[3:])).as_rotvec()
        if np.abs(step).max() < 1e-7 and k > 10:
            break
    return move


def _across(near: np.ndarray) -> np.ndarray:
    """(2,) unit vector across the outline through places (k, 2): where they differ least."""
    return np.linalg.svd(near - near.mean(axis=0))[2][-1]
