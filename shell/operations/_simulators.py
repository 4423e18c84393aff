"""Another simulator that is run along a recorded path: what is asked of it, and its force."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from palpate.diagnosis.forward.touches import LEAST_PRESSES
from palpate.mechanics.errors import OptionError
from palpate.mechanics.names import pairs, words_of
from palpate.operations._declare import option
from palpate.render.options import SETTINGS, RenderOptions
from palpate.render.registry import create, simulator_names

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np

    from palpate.mechanics.model.model import Model
    from palpate.mechanics.progress import Progress
    from palpate.mechanics.recording.recording import Recording
    from palpate.render.simulators.base import Adapter, SimulatorRenderer


SettingsOfSimulator = Annotated[
    str,
    option(
        "settings of --renderer: as its documentation says, or the most accurate",
        choices=SETTINGS,
        advanced=True,
    ),
]
NumbersOfSimulator = Annotated[
    str,
    option(
        "settings of --renderer to change: KEY=VALUE, comma separated",
        metavar="KEY=VALUE,...",
        advanced=True,
    ),
]


def simulator_option(words: str) -> Mapping[str, Any]:
    """--renderer NAME, of the other simulators alone."""
    return option(words, choices=simulator_names())


SHOWN_FROM, LONG_S = 0.01, 60.0
"""Share of a run from which on its whole time is estimated; s, of a long run."""


def time_words(whole_s: float, presses: int) -> str:
    """What is said of a run that takes so long over so many presses."""
    if whole_s < LONG_S or presses <= LEAST_PRESSES:
        return f"about {max(whole_s / 60, 0.1):.2g} min in all"
    fewer = whole_s * LEAST_PRESSES / presses
    return f"about {whole_s / 60:.2g} min in all; --presses {LEAST_PRESSES} takes {fewer / 60:.2g}"


class Ran(NamedTuple):
    """What a simulator gave: force (n, 3) N on the tool at every row of the recording, zeros where it was not
    run; over which (p,) of the recording's presses; of which adapter; its settings in words; which presses
    ended without an answer."""

    force: np.ndarray
    chosen: np.ndarray
    adapter: Adapter
    said: str
    notes: tuple[str, ...] = ()


def mended_by(settings: str, numbers: str, by: str) -> tuple[str, str]:
    """(settings, numbers) with what mends them on top: one of SETTINGS, KEY=VALUE words, or both."""
    words = words_of(by)
    named = [word for word in words if word in SETTINGS]
    over = dict(pairs(words_of(numbers), "--simulator-set", "edge_radii=0.5"))
    over |= dict(pairs([w for w in words if w not in named], "--mended", "edge_radii=0.5"))
    return (named or [settings])[-1], ",".join(f"{key}={value}" for key, value in over.items())


def simulator(name: str, settings: str, numbers: str, model: Model) -> SimulatorRenderer:
    """Ready to be run; raises OptionError where it is not installed or a setting is not there."""
    made: Any = create(name, model, RenderOptions(simulator_settings=settings, simulator_set=numbers))
    return made


def fewest(made: Sequence[SimulatorRenderer]) -> int | None:
    """Over how many presses all of them are run where nothing is asked, so that their gaps are of the same;
    None: all."""
    return min((each.adapter.presses for each in made if each.adapter.presses is not None), default=None)


def run_along(
    made: SimulatorRenderer, recording: Recording, progress: Progress, *, most: int | None = None
) -> Ran:
    """Run a simulator along a recording's presses, `most` of them, spread over its places (None: all). One
    for which it finds no answer is left out, and said; raises OptionError where that leaves too few."""
    from palpate.diagnosis.other_simulator.forces import spread_out
    from palpate.reconstruction.presses_on_model import presses_on
    from palpate.render.replay import replay_touches

    options = made.options
    numbers = f", {options.simulator_set}" if options.simulator_set else ""
    said = f"settings {options.simulator_settings}{numbers}"
    presses = presses_on(recording, made.model)
    asked = spread_out(presses, most)
    chosen, errors = asked.copy(), []

    def failed(number: int, error: OptionError) -> None:
        chosen[number] = False
        errors.append(error)
        if chosen.sum() < min(LEAST_PRESSES, asked.sum()):
            raise error

    begun, estimate = time.monotonic(), ""

    def show_progress(words: str, share: float) -> None:
        nonlocal estimate
        if not estimate and share > SHOWN_FROM:
            estimate = ", " + time_words((time.monotonic() - begun) / share, int(asked.sum()))
        progress(f"{made.name}, {said}: {words}{estimate}", share)

    force = replay_touches(made, recording, presses, asked, show_progress, failed)
    without = f"{len(errors)} of {asked.sum()} presses ended without an answer and are left out"
    notes = (f"{said}: {without}: {errors[0]}",) if errors else ()
    return Ran(force, chosen, made.adapter, said, notes)
