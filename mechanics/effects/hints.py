"""What only the search of a diagnosis needs to know of an effect; the defaults serve most."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from palpate.mechanics.effects.settings import TouchedScene


@dataclass(frozen=True)
class Misfit:
    """What starts can be sought from; p presses. level: (p,) share by which each is stiffer than predicted.
    answer: (p,) change of that share a unit of compliance along the normal, unit modulus, m. weight: (p,) of
    the level, 1 over its variance."""

    level: np.ndarray
    answer: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True)
class SearchHints:
    """How a diagnosis starts the fit of an effect, and how it weighs the evidence for it.

    candidates(): start vectors, where the parameters' own are not enough. seek(scene, misfit): start vectors
    found from the data. refine(scene, values): makes its law exact near a fit.
    few_places: it lives in few places, so the one that speaks loudest counts, and the shape may be its rival.
    any_form: it can take the form of others that differ from place to place, so it is no rival of one of them
    that gains more. slips: it caps the sideways force, where a fit that trusts the stick may go wrong.
    by_base: it acts through the base, as does not knowing how the object stands.
    by_first_touches: it shows by them alone, and not where another effect moved them or the surface was
    fitted to them.
    hides_strain: it bends force against depth the other way than finite strain, so neither shows alone.
    stands_for_strain: once it is named, finite strain may have been taken for it. expensive: a quick
    diagnosis leaves it out.
    phenomenon: what several effects are laws of: the first stands for all until it is picked, then the law
    with the most evidence is named; they are no rivals of one another.
    slack: factor on the lack of fit that its law may leave. systematic: (k,) standard deviations of its
    values that no noise tells, from known cases; systematic_share: the same in shares of the values; untold:
    (k,) standard deviations of the values where nothing is wrong, as a clock's; common_factor: standard
    deviation of a factor on all values that the modulus takes up. signed: values whose sign is sure once
    named. own_touches: it meets each place at a depth of its own, so first touches are fitted beside it
    though the surface is known.
    """

    candidates: Callable[[], list[np.ndarray]] | None = None
    seek: Callable[[TouchedScene, Misfit], list[np.ndarray]] | None = None
    refine: Callable[[TouchedScene, np.ndarray], None] | None = None
    few_places: bool = False
    any_form: bool = False
    slips: bool = False
    by_base: bool = False
    by_first_touches: bool = False
    hides_strain: bool = False
    stands_for_strain: bool = False
    expensive: bool = False
    phenomenon: str = ""
    slack: float = 1.0
    systematic: tuple[float, ...] = ()
    systematic_share: tuple[float, ...] = ()
    untold: tuple[float, ...] = ()
    common_factor: float = 0.0
    signed: tuple[int, ...] = ()
    own_touches: bool = False
