"""From which size on an effect shows, whatever the decision."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.diagnosis.forward.prediction import build_forward
from palpate.diagnosis.forward.touches import touches_of
from palpate.diagnosis.options import AttributionOptions, NuisanceOptions
from palpate.diagnosis.search.evidence import SEEN, Search, detectable
from palpate.diagnosis.search.fit import settings_of
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.model.model import Model


@pytest.fixture(scope="module")
def judged(bench):
    """(search, the plain fit) of presses with nothing in them."""
    recording, model = bench.record()
    forward = build_forward(touches_of(model.presses), model)
    search = Search(
        forward, 20e3, nuisance=NuisanceOptions(), options=AttributionOptions(), site_sd=None,
        finite_strain=effect("finite_strain"),
    )  # fmt: skip
    return search, search.judge([effect("finite_strain")])


def test_an_effect_as_large_as_its_limit_stands_out_by_as_much(judged):
    search, base = judged
    delay = effect("time_delay")
    limit = detectable(search, base, [delay])["time_delay"]
    found = base.found

    def change(seconds: float) -> np.ndarray:
        settings = settings_of(search.forward, found.effects, found.values, found.onset)
        before = search.forward.predict(settings)
        delay.act(settings, np.array([seconds]), search.forward)
        return search.forward.predict(settings) - before

    counted = search.forward.touches.counted
    size = np.sqrt((change(0.01)[counted] ** 2).sum(axis=1).mean())
    seconds = 0.01 * limit / size
    pair = np.stack([found.jacobian[:, :, 0], change(seconds)], axis=2)
    gram = search.whitener.gram(pair).sum(axis=0)
    left = gram[1, 1] - gram[0, 1] ** 2 / gram[0, 0]
    assert np.sqrt(left / search.forward.touches.noise.variance_inflation) == pytest.approx(SEEN, rel=0.15)


def test_a_spring_in_the_tool_hides_behind_modulus_and_first_touch_as_a_delay_does_not(judged):
    limits = detectable(*judged, [effect("time_delay"), effect("tip_radius"), effect("tool_compliance")])
    assert limits["time_delay"] < 0.5 * min(limits["tip_radius"], limits["tool_compliance"])


def test_an_effect_that_starts_from_nothing_has_a_limit_as_well(judged):
    limits = detectable(*judged, [effect("force_gain"), effect("modulus_gradient")])
    assert all(1e-4 < limit < 1.0 for limit in limits.values())


def test_a_move_shows_by_first_touches_only_where_the_surface_stayed(judged, monkeypatch):
    """Fitted to the same presses, the surface moves along with them."""
    search, base = judged
    move = effect("surface_offset")
    assert detectable(search, base, [move]) == {"surface_offset": np.inf}
    monkeypatch.setattr(Model, "fitted_to", lambda self, presses: False)
    assert detectable(search, base, [move])["surface_offset"] < 1.0
