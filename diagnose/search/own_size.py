"""What is asked of causes of another simulator's force, which no noise hides: that each changes it by enough
of its own, and that a form that can be another's does not stand for it.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.fit import settings_of
from palpate.diagnosis.search.leave_one_out import JudgedSet
from palpate.diagnosis.search.naming import Score
from palpate.mechanics.effects.base import Effect
from palpate.render.replay import rms_n


def size_n(search: Search, score: Score, chosen: Sequence[str], least: float) -> float:
    """N rms by which a score's effect changes the force. Of a simulator it is the effect's own force in the
    joint fit, all else as it is there, where what is chosen keeps its place beside it: once that had bent to
    do the other's work too, the prediction hardly moves."""
    if search.forward.measured or score.size_n > least:
        return score.size_n
    own, effects = own_n(search, score.candidate, score.effect), score.candidate.found.effects
    for effect in (e for e in effects if e.name in chosen and own > least):
        others = search.judge([e for e in effects if e is not effect], like=score.candidate)
        if search.score([effect], score.candidate, others).probability <= search.options.doubt:
            return score.size_n  # instead of it, not beside it
    return own


def own_n(search: Search, candidate: JudgedSet, effect: Effect) -> float:
    """N rms by which an effect changes the force of a fit, all else as it is there."""
    found, forward = candidate.found, search.forward
    without = found.values.copy()
    without[found.place_of(effect.name)] = effect.ideal
    both, rest = (
        forward.predict(settings_of(forward, found.effects, v, found.onset)) for v in (found.values, without)
    )
    return rms_n(np.nan_to_num(both - rest)[forward.touches.counted])


def without_wider(
    search: Search, chosen: list[str], current: JudgedSet, together: JudgedSet
) -> tuple[JudgedSet, list[str]]:
    """What was idle beside a form that can be another's stands instead of that form, where it may be there
    and the form is not needed beside it: a power of the force has a level of its own, so a plain gain was
    named a power. together: as chosen before anything was idle."""
    idle = [e for e in together.found.effects if e not in current.found.effects]
    for wider, narrow in itertools.product([e for e in current.found.effects if e.hints.any_form], idle):
        rest = [e for e in current.found.effects if e is not wider]
        none, alone, both = (
            search.judge([*rest, *more], like=together) for more in ((), (narrow,), (narrow, wider))
        )
        needed = search.passes(search.score([wider], both, alone))
        if not needed and search.passes(search.score([narrow], alone, none)):
            search.renew(alone.found)
            names = [narrow.name if n == wider.name else n for n in chosen]
            return search.judge(alone.found.effects, like=alone), names
    return current, chosen
