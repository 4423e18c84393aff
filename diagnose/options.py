"""What a diagnosis can be set to: how much is tried, what decides a name, how wide our own errors are.

All numbers that decide a name are in `AttributionOptions`; beside them stand the weights of evidence, fitted
to cases of known truth (search/naming.toml). Widths of our own errors default to their table
(mechanics.law_errors).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from scipy.special import logit

from palpate.mechanics.effects.registry import known
from palpate.mechanics.law_errors import (
    DepthLaw,
    Direction,
    FirstTouch,
    Latency,
    Repeats,
    Slip,
    Stiffness,
    Unnamed,
)
from palpate.mechanics.options import EXACT, option


@dataclass(frozen=True)
class DiagnoseOptions:
    """How much a diagnosis tries, and its seed. Raises OptionError for an effect that is not there."""

    fast: bool = option(
        False, "half a minute instead of three: fewer effects, one in an answer, less sampling"
    )
    without: str = option("", "effects to leave out of the library, comma separated (for tests of 'unknown')")
    exact: bool = option(False, EXACT)
    bootstrap: int = option(400, "resamplings of sites for intervals")
    seed: int = option(0, "seed of flips and resamplings")

    def __post_init__(self) -> None:
        for name in self.left_out:  # before any work
            known(name)

    @property
    def left_out(self) -> frozenset[str]:
        """The names in `without`."""
        return frozenset(name.strip() for name in self.without.split(",") if name.strip())


@dataclass(frozen=True)
class AttributionOptions:
    """When something is named: chances, and sizes that matter; docs/explanation/diagnosis.md lists them."""

    sure: float = option(0.5, "probability from which an effect is named")
    doubt: float = option(
        0.1,
        "chance that is too small to count: of odds, of a model confidence set, of what resamplings close",
    )
    smallest: float = option(
        0.5, "smallest gap that matters, rms over contact samples, of the noise of a force 3-vector"
    )
    least_of_first: float = option(
        0.25, "least size of a further effect, as a share of the first's size (no law is exact)"
    )
    most: int | None = option(
        None, "greatest number of effects in one answer; None: 3, of a quick diagnosis 1"
    )
    z: float = option(
        5.0, "standard errors beyond which a reading in free air or on the support is not chance"
    )
    shape_gain: float = option(
        12.0, "gain in log likelihood from which sites differ by more than their shape may"
    )
    unknown_chi: float = option(
        1.9,
        "lack of fit beyond which a remainder is unknown: mean square of samples over the noise's, or rms of "
        "places over their widths",
    )

    def within(self, most: int) -> AttributionOptions:
        """The same with at most so many effects in an answer, where nothing else was asked for."""
        return self if self.most is not None else replace(self, most=most)

    @property
    def greatest_number(self) -> int:
        """Of effects in one answer."""
        return 3 if self.most is None else self.most

    @property
    def beyond_doubt(self) -> float:
        """Log odds beyond which one of two is taken for certain."""
        return float(logit(1 - self.doubt))


@dataclass(frozen=True)
class NuisanceOptions:
    """One standard deviation of what the baseline may get wrong, before it counts as a gap."""

    onset_m: float = option(
        FirstTouch.diagnosis.value, "error of first touch on a surface that is known, each press", unit="m"
    )
    fitted_onset_m: float = option(
        FirstTouch.fitted.value, "the same on a surface that was fitted to the presses", unit="m"
    )
    fitted_onset_share: float = option(
        FirstTouch.fitted_share.value, "beside it, share of what such a surface states of itself, each press"
    )
    common_onset_m: float = option(
        FirstTouch.fitted_common.value,
        "beside what such a surface states, error of first touch, all presses",
        unit="m",
    )
    common_stick: float = option(Slip.level.value, "share by which dents may hold less sideways, all presses")
    shallow_stick: float = option(Slip.shallow.value, "the same of the shallowest dents, beside it")
    site_stiffness: float = option(
        Stiffness.diagnosis.value,
        "share by which a site's stiffness may be wrong, where the law's bound is not known",
    )
    law_bound: float = option(
        Stiffness.bound.value,
        "share by which a site's stiffness may be wrong by the law, in standard deviations of its bound",
    )
    surface: float = option(
        Stiffness.surface.value,
        "share by which a site's stiffness may be wrong, a unit of the surface's error over the height",
    )
    press_stiffness: float = option(Repeats.diagnosis.value, "share by which repeats at a site may differ")
    tilt: float = option(Direction.diagnosis.value, "error of a site's normal", unit="rad")
    stick: float = option(
        Slip.diagnosis.value, "share by which the tangential force may be wrong, each press"
    )
    leaning: float = option(
        Slip.leaning.value,
        "share by which the tangential force may be wrong in what exceeds the normal one, each sample",
    )
    law: float = option(
        DepthLaw.diagnosis.value, "share by which a site's depth law may bend wrongly over the depth reached"
    )
    latency_s: float = option(
        Latency.diagnosis.value, "error of when the force is read, each press", unit="s"
    )
    floor_share: float = option(
        Unnamed.share.value, "error of the model that no name covers, share of a sample's force"
    )
    floor_along: float = option(
        Unnamed.along.value, "by how much that share's variance adds up along a press"
    )
    floor_n: float = option(
        Unnamed.force.value, "error of the model that no name covers, each thinned component", unit="N"
    )

    def each_by_itself(self) -> NuisanceOptions:
        """The same without errors that presses share, and with first touches as wide whatever the surface."""
        return replace(
            self, fitted_onset_m=self.onset_m, fitted_onset_share=0.0,
            common_onset_m=0.0, common_stick=0.0, shallow_stick=0.0,
        )  # fmt: skip
