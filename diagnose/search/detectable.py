"""From which size on an effect can be seen in these presses at all, whatever the decision.

Each effect's own change of the force, near its starts, is weighed against noise, first touches, stiffness of
places and the other nuisances, with all projected out that a reconstruction fits to the same presses: the
modulus, and where each press first met the surface. What is left over is a number of standard deviations for
its size in newtons. What shows by less cannot be found in such touches, by nobody's rules.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.fit import settings_of
from palpate.diagnosis.search.gaps import modulus_share
from palpate.diagnosis.search.leave_one_out import Candidate
from palpate.diagnosis.search.whiten import Whitener
from palpate.mechanics.effects.base import Effect

SEEN = 4.7
"""Standard deviations: 3.1 for 2 % false alarms among twenty effects, 1.6 more to be seen 19 times of 20."""
FREE_M = 5e-3
"""Of a first touch, where the surface was fitted to it."""
STARTS = 4
"""Forms of an effect that are tried, about; the one that shows best counts."""
MOVES = 5
"""Steps of a parameter that is moved from where it does nothing."""


def detectable(search: Search, base: Candidate, effects: Sequence[Effect]) -> dict[str, float]:
    """{name: N rms over contact samples, a common factor taken off} of the smallest change that shows.

    Infinite where nothing of an effect is left beside modulus and nuisances.
    """
    forward, found = search.forward, base.found
    counted = forward.touches.counted
    plainly = settings_of(forward, found.effects, found.values, found.onset)
    before = np.nan_to_num(forward.predict(plainly))
    fitted = forward.model.fitted_to(forward.touches)
    names, changes = [], [found.jacobian[:, :, 0]]
    limits = {e.name: np.inf for e in effects if fitted and e.hints.by_first_touches}
    for effect in effects:
        if effect.name in (*found.names, *limits):
            continue
        for start in _forms(search, effect):
            settings = settings_of(forward, found.effects, found.values, found.onset)
            effect.act(settings, start, forward)
            names.append(effect.name)
            changes.append(np.nan_to_num(forward.predict(settings)) - before)
    whitener = search.whitener
    if fitted:
        free = np.full(len(forward.touches), FREE_M)
        whitener = Whitener(forward, plainly, search.nuisance, search.site_sd, free)
    gram = whitener.gram(np.stack(changes, axis=2)).sum(axis=0)
    plain = before[counted]
    inflation = forward.touches.noise.variance_inflation
    for i, name in enumerate(names, start=1):
        change = changes[i][counted]
        own = change - modulus_share(change, plain) * plain
        size = float(np.sqrt((own**2).sum(axis=1).mean()))
        left = (gram[i, i] - gram[i, 0] ** 2 / max(gram[0, 0], 1e-300)) / inflation
        limit = SEEN * size / np.sqrt(left) if left > 1e-12 else np.inf
        limits[name] = min(float(limit), limits.get(name, np.inf))
    return limits


def _forms(search: Search, effect: Effect) -> list[np.ndarray]:
    """Values (k,) at which an effect is there: some of its starts, or a move of each parameter where it
    starts from nothing."""
    starts = search.starts.get(effect.name) or effect.starts()
    there = [s for s in starts if not np.allclose(s, effect.ideal)]
    if not there:
        return [effect.ideal + move for move in np.diag([MOVES * p.step for p in effect.parameters])]
    return there[:: max(1, len(there) // STARTS)]
