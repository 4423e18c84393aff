"""Whether a model predicts presses at places that it has not seen: against a constant push, which knows
nothing, and against the 1D models, spread from the other places."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.mechanics.compliance.sites import TouchSites
from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.errors import ModelError
from palpate.mechanics.law_errors import DepthLaw, Stiffness
from palpate.mechanics.model.one_d_laws import LAWS, RIVALS, Fits, OneDLaws, forces_of, spread_law
from palpate.mechanics.presses.table import Presses
from palpate.reconstruction.steps.s6_one_d import columns, fit_robust, low_passed
from palpate.reconstruction.steps.s7_modulus.modulus import ModulusFit, combine
from palpate.reconstruction.steps.s7_modulus.press_fit import touched_as_fitted

_BLOCK_S = 0.004
BETTER = 0.95
"""Share of an error below which another is called smaller."""
OWN = 1.96 * float(np.hypot(Stiffness.diagnosis.value, DepthLaw.diagnosis.value))
"""Share of the force that our own law may be off by (95 %): a 1D model that learnt from presses has no such
error, so an excess below it says nothing against the model."""


@dataclass(frozen=True)
class HeldOutErrors:
    """N, rms of the 3-vector over contact samples of presses whose place was held out.

    model_n: of the model, its modulus, or field of it, told by the other places. constant_n: of their mean
    push along the normal, whatever the depth. floor_n: of the better 1D model, whose name is `floor`, spread
    from the other places. behind: by how many standard errors over places (paired) the model's mean square
    exceeds the floor's. force_n: of what was measured.
    """

    model_n: float
    constant_n: float
    floor: str = ""
    floor_n: float = float("nan")
    behind: float = float("-inf")
    force_n: float = float("nan")

    @property
    def doubt(self) -> str:
        """Why the model is not reliable; '' where it predicts, and no 1D model does so better by more than
        our own law may be off."""
        if self.model_n > self.constant_n:
            return (
                f"the model does not predict: on places that were held out it errs by {self.model_n:.3g} N, "
                f"a constant push by {self.constant_n:.3g} N"
            )
        if not self.beaten_by or self.model_n**2 - self.floor_n**2 < (OWN * self.force_n) ** 2:
            return ""
        return (
            f"a 1D model predicts better: on places that were held out {self.beaten_by} errs by "
            f"{self.floor_n:.3g} N, this model by {self.model_n:.3g} N"
        )

    @property
    def beaten_by(self) -> str:
        """The 1D model that errs less by more than `BETTER` and the paired error over places; '' if none."""
        return self.floor if self.behind > 1 and self.floor_n < BETTER * self.model_n else ""


def modulus_by_others(fit: ModulusFit) -> np.ndarray | None:
    """(p,) Pa, the modulus of each press by the presses of other places; None where any has none."""
    modulus = np.full(len(fit.site), np.nan)
    for place in np.unique(fit.site):
        seen = fit.site != place
        own = fit.press.modulus_pa[seen], fit.press.relative_error[seen]
        if not (np.isfinite(own[1]) & (own[0] > 0)).any():
            return None
        modulus[~seen] = combine(*own, fit.site[seen])[0]
    return modulus


def held_out(
    presses: Presses, sites: TouchSites, fit: ModulusFit, by_others_pa: np.ndarray | None
) -> HeldOutErrors | None:
    """Presses that touch at `sites` (one a press, in order), each place predicted by all the others; None
    where there is one place alone or nothing to predict. First touches that were not recorded are where the
    fit has them, for every model alike.

    by_others_pa: (p,), by `modulus_by_others`, as if the object were of one modulus.
    """
    presses = touched_as_fitted(presses, fit.press)
    smooth = low_passed(presses)
    data = replace(smooth, force=presses.net.force).window(0.0, 0.0).thinned(_BLOCK_S)
    if by_others_pa is None or len(np.unique(presses.site)) < 2 or not len(data.press):
        return None
    fits = columns(fit_robust(smooth.window(0.0, 0.0), presses.noise.raw_n), by_others_pa)
    unit = forces_at(
        sites, data.displacement, data.starts, young_modulus_pa=1.0, tip_radius_m=presses.tip_radius_m,
        law=fit.press.law,
    )  # fmt: skip
    missed = _squares(by_others_pa[data.press, None] * unit, data)
    floors = {name: square for name in RIVALS if (square := _of_one_d(name, fits, data)) is not None}
    constant = _rms(_squares(_constant(data), data))
    if not floors:
        return HeldOutErrors(_rms(missed), constant)
    floor = min(floors, key=lambda name: floors[name].mean())
    worse = np.bincount(data.site[data.press], weights=missed - floors[floor])
    error = float(np.sqrt(len(worse)) * worse.std(ddof=1))
    return HeldOutErrors(
        _rms(missed), constant, floor, _rms(floors[floor]), float(worse.sum()) / max(error, 1e-300),
        force_n=_rms((data.force**2).sum(axis=1)),
    )  # fmt: skip


def _constant(data: Presses) -> np.ndarray:
    """(n, 3) N along the normal: the mean push of the other places."""
    of = data.site[data.press]
    total, count = np.bincount(of, weights=data.push), np.bincount(of)
    others = (data.push.sum() - total) / np.maximum(len(of) - count, 1)
    return others[of, None] * data.normal[data.press]


def _of_one_d(name: str, fits: Fits, data: Presses) -> np.ndarray | None:
    """(n,) N^2 that a 1D model errs by, spread to each place from the others; None where they tell none."""
    own = LAWS[name](fits)
    spread = np.full((4, len(data)), np.nan)
    try:
        for place in np.unique(data.site):
            seen, here = data.site != place, data.site == place
            law = OneDLaws(*(column[seen] for column in own))
            spread[:, here] = spread_law(data.point[seen], data.site[seen], law, data.point[here])
    except ModelError:
        return None
    return _squares(forces_of(OneDLaws(*spread), data), data)


def _squares(force: np.ndarray, data: Presses) -> np.ndarray:
    return ((force - data.force) ** 2).sum(axis=1)


def _rms(squares: np.ndarray) -> float:
    return float(np.sqrt(squares.mean()))
