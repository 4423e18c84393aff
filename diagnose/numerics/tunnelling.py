"""Tunnelling: the tip passes through the surface and is no longer pushed back, though it is inside."""

import numpy as np

from diagnose.numerics.base import DOMAIN, LEAST_SHARE, NumericalEffect, Seen, Signal
from diagnose.numerics.lost_contact import LONGEST_S
from mechanics.effects.base import Parameter, Role, Scope, no_keys
from mechanics.samples import runs
from mechanics.schema import Key

INSIDE = 0.5
"""Of a press's greatest depth, beyond which a tip without force is inside without being felt."""


def _see(signal: Signal) -> Seen:
    left, through, never = signal.left.copy(), 0, 0
    usual = np.median([np.linalg.norm(signal.force[part], axis=1).max(initial=0.0) for part in signal.parts])
    for part in signal.parts:
        size, depth, t = np.linalg.norm(signal.force[part], axis=1), signal.depth[part], signal.t[part]
        if len(size) < 5:
            continue
        silent = (size < LEAST_SHARE * min(size.max(), usual)) & (depth > INSIDE * depth.max()) & (depth > 0)
        if not size.max() > 0:
            silent = (depth > INSIDE * depth.max()) & (depth > 0) & bool(usual > 0)
        # a force that comes late comes all the same, and a tip between nodes is felt at its deepest
        felt = np.flatnonzero(size > LEAST_SHARE * usual)
        over, deepest = int(felt[-1]) if len(felt) else -1, int(np.argmax(depth))
        lasting = [
            (a, b) for a, b in runs(silent) if t[b - 1] - t[a] > LONGEST_S and over < a and deepest < b
        ]
        if lasting:
            through += 1
            never += over < 0
            # from where it fell through until it has come out again
            left[part.start + lasting[0][0] : part.stop] = True
    if not through:
        return Seen(signal, {})
    mended = Signal(signal.t, signal.force, signal.depth, signal.parts, left)
    return Seen(mended, {"share": through / len(signal.parts), "never_felt": never / len(signal.parts)})


EFFECT = NumericalEffect(
    name="tunnelling",
    domain=DOMAIN,
    scope=Scope.READING,
    words="the tip passes through the surface: inside, and no force",
    plain_words="the simulated tip falls through the surface and is not felt any more",
    parameters=(Parameter("share", "1", 0.0, 1.0, 0.0, (0.0,), 0.01),),
    keys={"share": Key(low=0.0, high=1.0, required=True)},
    report=no_keys,
    role=Role.FREE_AIR,
    see=_see,
    advice="take smaller time steps, or contact that looks along the path (continuous) or into the volume, "
    "not at a thin shell",
)
