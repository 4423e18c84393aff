"""Whether a modulus predicts presses that it has not seen: against a constant push, which knows nothing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechanics.presses import Presses
from mechanics.sites import TouchSites
from mechanics.touch import forces_at
from reconstruct.steps.s7_modulus.modulus import ModulusFit, combine

_BLOCK_S = 0.004


@dataclass(frozen=True)
class HeldOut:
    """N, rms of the 3-vector over contact samples of presses whose place was held out.

    model_n: of the modulus that the other places tell. constant_n: of their mean push along the normal,
    whatever the depth.
    """

    model_n: float
    constant_n: float

    @property
    def doubt(self) -> str:
        """Why the modulus is not to be believed; '' where it predicts."""
        if self.model_n <= self.constant_n:
            return ""
        return (
            f"the model does not predict: on places that were held out it errs by {self.model_n:.3g} N, a "
            f"constant push by {self.constant_n:.3g} N"
        )


def held_out(presses: Presses, sites: TouchSites, fit: ModulusFit) -> HeldOut | None:
    """Presses that touch at `sites` (one a press, in order), each place predicted by all the others; None
    where there is one place alone or nothing to predict. First touches are as read."""
    data = presses.net.window(0.0, 0.0).thinned(_BLOCK_S)
    places = np.unique(presses.site)
    if len(places) < 2 or not len(data.press):
        return None
    modulus = np.full(len(presses), np.nan)
    for place in places:
        seen = presses.site != place
        own = fit.press.modulus_pa[seen], fit.press.relative_error[seen]
        if not (np.isfinite(own[1]) & (own[0] > 0)).any():
            return None
        modulus[~seen] = combine(*own, presses.site[seen])[0]
    unit = forces_at(
        sites, data.displacement, data.starts, young_modulus_pa=1.0, tip_radius_m=presses.tip_radius_m,
        law=fit.press.law,
    )  # fmt: skip
    of = presses.site[data.press]
    normal = presses.normal[data.press]
    push = np.einsum("ij,ij->i", data.force, normal)
    total, count = np.bincount(of, weights=push), np.bincount(of)
    others = (push.sum() - total) / np.maximum(len(push) - count, 1)
    return HeldOut(
        _rms(modulus[data.press, None] * unit - data.force), _rms(others[of, None] * normal - data.force)
    )


def _rms(error: np.ndarray) -> float:
    return float(np.sqrt((error**2).sum(axis=1).mean()))
