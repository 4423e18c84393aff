"""The numbers that decide what is named, all of them.

Beside them stand the weights of evidence and closure, fitted to cases of known truth (naming.toml),
and the widths of our own errors (`whiten.NuisanceOptions`), which say what counts as a gap at all.
"""

from __future__ import annotations

from dataclasses import dataclass

from scipy.special import logit

from mechanics.options import option


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
        0.25,
        "least size of a further effect, of the first's: no law is exact, what it leaves is no effect",
    )
    most: int = option(3, "effects in one answer, at most")
    z: float = option(5.0, "standard errors beyond which what free air or the support reads is no chance")
    shape_gain: float = option(
        12.0, "gain in log likelihood from which sites differ by more than their shape may"
    )
    unknown_chi: float = option(1.9, "lack of fit (whitened mean square) beyond which a remainder is unknown")

    @property
    def beyond_doubt(self) -> float:
        """Log odds beyond which one of two is taken for certain."""
        return float(logit(1 - self.doubt))
