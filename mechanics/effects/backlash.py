"""Backlash: a play between the tip and the position sensor. A loop of constant width, whatever the rate.

Moved by the hand at the tip, the sensor lags (negative width here: the tip is ahead of its reading); moved
from the sensor's side, the tip lags (positive). The contract's key is the width of the play, in both. It is
not taken off a recording: the tip's side of the play is not known in free air.
"""

import numpy as np

from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene
from palpate.mechanics.recording.side_of_play import play


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    width, frame = values[0], scene.places.frame[scene.press]
    if width <= 0:
        # the hand moves the tip and the reading follows once the play is taken up
        ahead = 0.5 * width * np.einsum("nij,nj->ni", frame, scene.lead)
        settings.move(lambda y: y + ahead)
        settings.unsure_m = 0.5 * abs(width) * np.sqrt((scene.unsure**2).mean(axis=1))
        return

    def move(y: np.ndarray) -> np.ndarray:
        device = np.ascontiguousarray(np.einsum("nij,ni->nj", frame, y))
        played = np.empty_like(device)
        # a way into the object is one against the frame's axes
        play(scene.start, device, -scene.lead[scene.start[:-1]], width, played)
        return np.einsum("nij,nj->ni", frame, played)

    settings.move(move)


EFFECT = Effect(
    name="backlash",
    domain="instrument",
    scope=Scope.TIME,
    words="a constant play lies between the tip and the position sensor",
    parameters=(Parameter("width_m", "m", -2e-3, 2e-3, 0.0, (1e-4, 4e-4, -1e-4, -4e-4), 2e-5),),
    keys={"width_m": FileKey(low=0.0, high=0.1, unit="m", required=True)},
    report=lambda values, scene, modulus_pa: {"width_m": abs(float(values[0]))},
    change=_change,
    hints=SearchHints(
        # within the play the tip's place is not known, so a fit with the right width still misses
        slack=2.5,
        systematic_share=(0.15,),
    ),
)
