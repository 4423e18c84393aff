"""Tunnelling: the tip passes through the surface, and is pushed back less the deeper it goes, not at all, or
is pulled in.

It shows along the press: the push, force along the outward normal, falls while the tip goes deeper, and
either never comes back before the tip is out, or comes back as the tip does, or is below zero. A late force,
and one that goes with the tip's speed, do none of these.
"""

import dataclasses

import numpy as np

from palpate.diagnosis.numerics.base import LEAST_SHARE, NumericalEffect, SampleEvidence, Signal
from palpate.diagnosis.numerics.lost_contact import LONGEST_S
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Parameter, Role, Scope, no_keys
from palpate.mechanics.recording.segments import runs

INSIDE = 0.5
"""Of a press's greatest depth, beyond which a tip without force is inside without being felt."""
FELL_TO, CAME_BACK = 0.7, 0.1
"""Shares of the greatest push before: what it falls to as the tip goes deeper, and by how much more it pushes
again as the tip comes back."""
DEEPER = 0.02
"""Of a press's greatest depth, by which the tip is deeper than where it was pushed most."""
STAYED = 0.2
"""Share of its samples in which a silent tip is at rest or on its way in: else it is let go by damping."""
_STEP = 5


def _coming_out(depth: np.ndarray) -> np.ndarray:
    """(n,) bool: the tip is on its way out, over ten rows, as positions come in an encoder's steps."""
    padded = np.pad(depth, _STEP, mode="edge")
    return padded[2 * _STEP :] < padded[: -2 * _STEP]


def _silent(push: np.ndarray, depth: np.ndarray, t: np.ndarray, usual: float) -> int | None:
    """The row from which a tip that is inside is not felt for as long as it is there; None: it is felt."""
    inside = (depth > INSIDE * depth.max()) & (depth > 0)
    silent = inside & (push < LEAST_SHARE * min(push.max(), usual) if push.max() > 0 else usual > 0)
    # a force that comes late comes all the same, and a tip between nodes is felt at its deepest
    felt = np.flatnonzero(push > LEAST_SHARE * usual)
    over, deepest = int(felt[-1]) if len(felt) else -1, int(np.argmax(depth))
    stays = ~_coming_out(depth)
    lasting = [
        a for a, b in runs(silent)
        if t[b - 1] - t[a] > LONGEST_S and over < a and deepest < b and stays[a:b].mean() > STAYED
    ]  # fmt: skip
    return lasting[0] if lasting else None


def _turned(push: np.ndarray, depth: np.ndarray, t: np.ndarray, usual: float) -> int | None:
    """The row of the greatest push of a tip that is pushed back less as it goes deeper; None: it is not."""
    most = np.maximum.accumulate(push)
    if not most[-1] > LEAST_SHARE * usual:
        return None
    strongest = np.maximum.accumulate(np.where(push >= most, np.arange(len(push)), 0))
    deeper = depth > depth[strongest] + DEEPER * depth.max()
    deepest = int(np.argmax(depth))
    fallen = deeper & (push < FELL_TO * most) & (depth > INSIDE * depth.max())
    coming_out = _coming_out(depth)
    for a, b in runs(fallen):
        if not (a <= deepest < b and t[b - 1] - t[a] > LONGEST_S):
            continue
        out, inwards = push[deepest:][coming_out[deepest:]], push[a:b][~coming_out[a:b]]
        back = out.max(initial=0.0) - max(push[deepest], 0.0) > CAME_BACK * most[a]
        if back or inwards.min(initial=0.0) < -LEAST_SHARE * most[a]:
            return int(strongest[a])
    return None


def _see(signal: Signal) -> SampleEvidence:
    left, push, never, from_m = signal.left.copy(), signal.push, 0, []
    usual = float(np.median([push[part].max(initial=0.0) for part in signal.parts]))
    for part in signal.parts:
        if part.stop - part.start < 5:
            continue
        own = push[part], signal.depth[part], signal.t[part], usual
        fell = _silent(*own)
        if fell is None:
            fell = _turned(*own)
        if fell is not None:
            from_m.append(float(signal.depth[part][fell]))
            never += not own[0].max() > LEAST_SHARE * usual
            # from where it fell through until it has come out again
            left[part.start + fell : part.stop] = True
    if not from_m:
        return SampleEvidence(signal, {})
    mended = dataclasses.replace(signal, left=left)
    keys = {"share": len(from_m) / len(signal.parts), "never_felt": never / len(signal.parts)}
    return SampleEvidence(mended, keys | {"from_depth_m": float(np.median(from_m))})


EFFECT = NumericalEffect(
    name="tunnelling",
    scope=Scope.READING,
    words="the tip passes through the surface: inside, and pushed back less, not at all, or pulled in",
    plain_words="the simulated tip falls through the surface and is not pushed back any more",
    parameters=(Parameter("share", "1", 0.0, 1.0, 0.0, (0.0,), 0.01),),
    keys={"share": FileKey(low=0.0, high=1.0, required=True)},
    report=no_keys,
    role=Role.FREE_AIR,
    see=_see,
    advice="take a finer mesh under the tip with a harder contact and smaller time steps, contact that looks "
    "along the path (continuous) or into the volume, not at a thin shell, and a material that resists being "
    "crushed flat (neo-Hookean)",
)
