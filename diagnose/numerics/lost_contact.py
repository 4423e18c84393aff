"""Lost or flickering contact: samples without force in the midst of a press. It shows in the samples
themselves: they are filled from those beside them before any law is looked at."""

import dataclasses

import numpy as np
from scipy.ndimage import grey_closing

from palpate.diagnosis.numerics.base import LEAST_SHARE, NumericalEffect, SampleEvidence, Signal
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Parameter, Role, Scope, no_keys

LONGEST_S = 0.05
"""Of a gap that counts as flicker; longer ones are contact that was lost for good (`tunnelling`)."""
FELL_TO = 0.3
"""Of the force around, below which a sample has lost contact."""


def lost(signal: Signal) -> tuple[np.ndarray, np.ndarray]:
    """((n,) samples that lost contact, (n,) samples in contact)."""
    gone, held = np.zeros(len(signal.t), bool), np.zeros(len(signal.t), bool)
    for part in signal.parts:
        size = np.linalg.norm(signal.force[part], axis=1)
        if len(size) < 5 or not size.max() > 0:
            continue
        step = float(np.median(np.diff(signal.t[part])))
        half = max(1, round(LONGEST_S / step / 2))
        # before and after a press there is no force: what rises late or falls early has lost nothing
        around = grey_closing(np.pad(size, 2 * half), 2 * half + 1)[2 * half : -2 * half]
        own = around > LEAST_SHARE * size.max()
        gone[part] = own & (size < FELL_TO * around)
        held[part] = own
    return gone, held


def filled(signal: Signal, gone: np.ndarray) -> np.ndarray:
    """(n, 3) N, straight lines over the samples that are gone."""
    force = signal.force.copy()
    for part in signal.parts:
        out, t = gone[part], signal.t[part]
        if out.any() and not out.all():
            for axis in range(3):
                own = force[part, axis]
                own[out] = np.interp(t[out], t[~out], own[~out])
    return force


def _see(signal: Signal) -> SampleEvidence:
    gone, held = lost(signal)
    if not gone.any():
        return SampleEvidence(signal, {})
    mended = dataclasses.replace(signal, force=filled(signal, gone))
    return SampleEvidence(mended, {"share": float(gone.sum() / held.sum())})


EFFECT = NumericalEffect(
    name="lost_contact",
    scope=Scope.READING,
    words="contact flickers: samples without force in the midst of a press",
    plain_words="the simulated tip loses the surface again and again",
    parameters=(Parameter("share", "1", 0.0, 1.0, 0.0, (0.0,), 0.01),),
    keys={"share": FileKey(low=0.0, high=1.0, required=True)},
    report=no_keys,
    role=Role.FREE_AIR,
    see=_see,
    advice="take smaller time steps, look for contacts from farther away, or damp the contact",
)
