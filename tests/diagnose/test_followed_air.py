"""Free air that was followed through touches may have gone another way in between, and weighs less for it."""

from __future__ import annotations

import dataclasses

import numpy as np

from diagnose.forward import build_forward
from diagnose.touches import touches_of
from diagnose.whiten import FOLLOWED, NuisanceOptions, Whitener


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
