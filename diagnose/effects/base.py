"""What an effect is: a name, a domain, parameters with bounds, and the settings of the forward model it
changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from diagnose.forward import Forward, Settings

DOMAINS = ("object", "contact", "boundary", "instrument")


@dataclass(frozen=True)
class Parameter:
    """One scalar that a fit moves: bounds, starts and step in the stated unit; `ideal` is its value without
    effect.

    prior_std: width of a Gaussian pull towards `ideal` (None: only the bounds hold it).
    """

    name: str
    unit: str
    low: float
    high: float
    ideal: float
    starts: tuple[float, ...]
    step: float
    prior_std: float | None = None


@dataclass(frozen=True)
class Effect:
    """A departure from the ideal model.

    change(settings, values, forward): sets what the forward model needs, in place.
    report(values, forward): the contract's keys in SI units, device frame.
    needs: stages that must be computed first ('fields', 'poisson', 'springs', 'unbonded').
    candidates(forward): starts found from the data, where the parameters' own are not enough.
    signature: in words. extra: 'slack', a factor on the lack of fit that its own law may leave; 'systematic',
    (k,) standard deviations of its values that no noise tells, from known cases; 'systematic_share', the same
    in shares of the values; 'common_factor', standard deviation of a factor on all values that the modulus
    takes up; 'signed', values whose sign is sure once named.
    """

    name: str
    domain: str
    words: str
    parameters: tuple[Parameter, ...]
    change: Callable[[Settings, np.ndarray, Forward], None]
    report: Callable[[np.ndarray, Forward], dict[str, Any]]
    needs: tuple[str, ...] = ()
    candidates: Callable[[Forward], list[np.ndarray]] | None = None
    signature: str = ""
    extra: dict[str, Any] = field(default_factory=dict)

    @property
    def ideal(self) -> np.ndarray:
        """(k,) values at which the effect is absent."""
        return np.array([p.ideal for p in self.parameters])

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest values, (k,) each."""
        return np.array([p.low for p in self.parameters]), np.array([p.high for p in self.parameters])

    def starts(self, forward: Forward) -> list[np.ndarray]:
        """Start vectors of a fit."""
        if self.candidates is not None:
            return self.candidates(forward)
        count = max((len(p.starts) for p in self.parameters), default=1)
        return [
            np.array([p.starts[min(i, len(p.starts) - 1)] for p in self.parameters], dtype=float)
            for i in range(count)
        ]
