"""Free air that was followed through touches may have gone another way in between, and weighs less for it."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.diagnosis.forward.prediction import build_forward
from palpate.diagnosis.forward.touches import FOLLOWED, touches_of
from palpate.diagnosis.options import AttributionOptions, NuisanceOptions
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.whiten import Whitener
from palpate.mechanics.effects.registry import effect


def test_what_a_turning_tool_may_have_read_between_is_forgiven_as_far_as_its_ends_tell(bench):
    _, model = bench.record()
    touches = touches_of(model.presses)
    along = np.concatenate([np.linspace(0.0, 1.0, p.stop - p.start) for p in touches.parts])
    bump = np.outer(0.1 * np.sin(np.pi * along), [0.0, 0.0, 1.0])
    bump = np.einsum("nij,nj->ni", touches.frame[touches.press], bump)

    def weighed(turned_n: float) -> float:
        air = np.outer(turned_n * along, [0.6, 0.0, 0.8])
        seen = dataclasses.replace(touches, columns={**touches.columns, FOLLOWED: air})
        forward = build_forward(seen, model)
        whitener = Whitener(forward, forward.ideal(model.material.young_modulus_pa), NuisanceOptions())
        return float(whitener.gram(bump[:, :, None]).sum())

    still, turned = weighed(0.0), weighed(0.5)
    assert turned < 0.02 * still
    # and no more: what stands still in the air before and after was known there all the while
    plain = build_forward(touches, model)
    whitener = Whitener(plain, plain.ideal(model.material.young_modulus_pa), NuisanceOptions())
    assert np.isclose(still, whitener.gram(bump[:, :, None]).sum(), rtol=1e-9)


@pytest.mark.parametrize("moment", [0.3, 0.5, 0.8])
def test_a_tool_that_turns_at_once_leaves_nothing_unknown(bench, moment):
    """No few smooth modes hold a step; what they leave of it is as loud as the step may be."""
    _, model = bench.record()
    touches = touches_of(model.presses)
    along = np.concatenate([np.linspace(0.0, 1.0, p.stop - p.start) for p in touches.parts])
    turned = np.array([0.3, 0.0, 0.4])
    seen = dataclasses.replace(touches, columns={**touches.columns, FOLLOWED: np.outer(along, turned)})
    forward = build_forward(seen, model)
    whitener = Whitener(forward, forward.ideal(model.material.young_modulus_pa), NuisanceOptions())
    missed = np.einsum("nij,nj->ni", touches.frame[touches.press], np.outer((along > moment) - along, turned))
    misfit = whitener.gram(missed[:, :, None]).sum() / (3 * whitener.counts().sum())
    assert 0.1 < misfit < AttributionOptions().unknown_chi


def test_what_the_air_may_hide_is_no_slip(bench):
    """A press whose sideways force is off while the tool turned, and the same beside air that stood still."""
    _, model = bench.record()
    touches = touches_of(model.presses)
    along = np.concatenate([np.linspace(0.0, 1.0, p.stop - p.start) for p in touches.parts])

    def off(turned_n: float) -> float:
        air = np.outer(turned_n * along * (touches.press == 5), [0.0, 1.0, 0.0])
        seen = dataclasses.replace(touches, columns={**touches.columns, FOLLOWED: air})
        forward = build_forward(seen, model)
        search = Search(
            forward, model.material.young_modulus_pa, nuisance=NuisanceOptions(),
            options=AttributionOptions(), site_sd=None, finite_strain=effect("finite_strain"),
        )  # fmt: skip
        missed = np.zeros_like(touches.local_force)
        missed[touches.press == 5] = [0.0, 1.0, 1.0]
        residual = missed * np.sign(-touches.local_force)
        return search.sideways_off(SimpleNamespace(residual=residual))

    assert off(0.0) > 0.3
    assert off(2.0) == 0.0
