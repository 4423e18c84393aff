"""What the instrument shows of itself before any press is weighed: one value, made once from the recording.

Whatever comes after it in a diagnosis takes the readings, and no recording.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.forward.touches import REACH_M, reached, touches_of, unobservable_effects
from palpate.diagnosis.instrument.free_air import FreeAir, free_air_of
from palpate.diagnosis.instrument.support_readings import Move, Rigid, move_of, rigid_of
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.recording.recording import Recording


@dataclass(frozen=True)
class Readings:
    """presses: on the model, all of them. fitted: the model's surface was fitted to them. met: (p,) bool,
    those that met that surface or can be moved there. touches: the thinned view of these, as read.

    free: of free air. rigid: of the rigid support. move: of the object between two tracings of its base, None
    where the surface was fitted to other presses. Each is None where the recording has too little of it.
    """

    presses: Presses
    fitted: bool
    met: np.ndarray
    touches: Presses
    free: FreeAir | None
    rigid: Rigid | None
    move: Move | None

    @property
    def unobservable(self) -> set[str]:
        """Names of the effects that presses of this kind cannot show."""
        return unobservable_effects(self.presses)

    @property
    def one_by_one(self) -> bool:
        """Whether presses of one place are a group each, as there are too few places (`touches_of`)."""
        return self.touches.sites != self.presses.of(self.met).sites

    @property
    def not_weighed(self) -> tuple[str, ...]:
        """In words, which presses are not weighed."""
        lost = int((~self.met).sum())
        words = f"presses not weighed, as the surface passes them by over {1e3 * REACH_M:g} mm: {lost}"
        return (words,) if lost else ()


def readings_of(recording: Recording, presses: Presses, normal: np.ndarray, *, fitted: bool) -> Readings:
    """All that can be read off the instrument; normal (3,): of the support, outward.

    fitted: the model's surface was fitted to these presses. A surface of another recording's may be passed
    because the object moved, so all presses stay. Raises DiagnosisError where they are too few.
    """
    met = reached(presses) if fitted else np.ones(len(presses), dtype=bool)
    touches = touches_of(presses.of(met))
    return Readings(
        presses=presses,
        fitted=fitted,
        met=met,
        touches=touches,
        free=free_air_of(recording, presses),
        rigid=rigid_of(recording, presses, normal),
        move=move_of(recording, presses, normal, touches.point.mean(axis=0)) if fitted else None,
    )
