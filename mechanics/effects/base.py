"""What an effect is: words, domain, scope, parameters, its law, and what it does to a model or a recording.

A law stands once. What a tip feels where it touches is set on a `Touch`, which prediction and renderer both
read; what follows the path of a press is a compiled `Law`, which both step along it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from palpate.mechanics.disk.schema import ANY, Schema
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.law import PathLaw
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene, TouchTerms
from palpate.mechanics.errors import ModelError
from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import Recording

Keys = Mapping[str, Any]
"""An effect's parameters as recording, model and JSON state them: SI units, device frame."""


class Scope(Enum):
    """Where an effect shows; it says how evidence for it is weighed."""

    TIME = "in the time course of a press"
    PRESS = "within a press, whatever its time course"
    PLACES = "from place to place"
    EVERYWHERE = "at every place alike, from depth to depth or direction to direction"
    READING = "on every reading, in free air too"

    @property
    def between_places(self) -> bool:
        """Whether leaving a place out of a fit takes evidence with it: judged in sample, at a price."""
        return self in (Scope.PLACES, Scope.EVERYWHERE)


class Role(Enum):
    """How a diagnosis comes to an effect."""

    SEARCHED = "tried, alone and with others"
    FREE_AIR = "found in free air before any press is looked at"
    KNOWN = "known physics without a parameter: in every solid, so that only its size is estimated"
    REST = "remaining differences between places that nothing else explains"


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

    words: what it is; plain_words: the same for a person who knows no mechanics, where that needs others.
    report(values, scene, modulus_pa): its keys; keys: their types, ranges and units, as a model's
    [effects.NAME] may hold them; keys_in_words(keys): where a list of numbers says little.
    touch(touch, keys, model): its law, where it acts on what one tip feels; prediction and renderer run it.
    change(settings, values, scene): what it does to a prediction besides, or instead where its keys say less
    than its values.
    of_material(touch, model): its law, where the model's material says it.
    law: what it does along the path of a touch; `touch` sets its numbers.
    apply(model, keys): the model with the effect; None: it is not rendered. `unchanged` where the law reads
    the keys.
    hold(keys, young_modulus_pa): how the base is held, as fields of mechanics.elastic.held_base.BaseHold.
    correct(recording, keys): the recording without it; None: it cannot be taken off.
    read_as: place among the corrections of a reading; what the instrument does last is taken off first.
    hints: what only the search of a diagnosis needs.
    """

    name: str
    domain: str
    scope: Scope
    words: str
    parameters: tuple[Parameter, ...]
    report: Callable[[np.ndarray, TouchedScene, float], dict[str, Any]]
    keys: Schema | None = ANY
    plain_words: str = ""
    keys_in_words: Callable[[Keys], str] | None = None
    role: Role = Role.SEARCHED
    touch: Callable[[TouchTerms, Keys, Model], None] | None = None
    change: Callable[[ForwardSettings, np.ndarray, TouchedScene], None] | None = None
    of_material: Callable[[TouchTerms, Model], None] | None = None
    law: PathLaw | None = None
    apply: Callable[[Model, Keys], Model] | None = None
    hold: Callable[[Keys, float], dict[str, Any]] | None = None
    correct: Callable[[Recording, Keys], Recording] | None = None
    read_as: int = 0
    hints: SearchHints = SearchHints()

    @property
    def rendered(self) -> bool:
        """Whether it belongs into a model."""
        return self.apply is not None

    @property
    def in_material(self) -> bool:
        """Whether a model that has it says so by its typed material."""
        return self.apply is not None and self.apply is not unchanged

    @property
    def ideal(self) -> np.ndarray:
        """(k,) values at which the effect is absent."""
        return np.array([p.ideal for p in self.parameters])

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest values, (k,) each."""
        return np.array([p.low for p in self.parameters]), np.array([p.high for p in self.parameters])

    def starts(self) -> list[np.ndarray]:
        """Start vectors of a fit."""
        if self.hints.candidates is not None:
            return self.hints.candidates()
        count = max((len(p.starts) for p in self.parameters), default=1)
        return [
            np.array([p.starts[min(i, len(p.starts) - 1)] for p in self.parameters], dtype=float)
            for i in range(count)
        ]

    def act(self, settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
        """Set what a prediction needs for these values (k,), in place."""
        if self.change is not None:
            self.change(settings, values, scene)
        elif self.touch is not None:
            keys = self.report(values, scene, settings.modulus)
            self.touch(settings.touch, keys, scene.places.model)

    def set_touch(self, touch: TouchTerms, keys: Keys, model: Model) -> None:
        """Set what a tip feels for these keys; raises ModelError where they are missing or impossible."""
        if self.touch is None:
            return
        try:
            self.touch(touch, keys, model)
        except KeyError as error:
            raise ModelError(
                f"an effect of the model lacks its key {error}: diagnose the recording again"
            ) from error
        except (TypeError, ValueError) as error:
            raise ModelError(f"an effect of the model has a value that is no number: {error}") from error

    def applied(self, model: Model, keys: Keys) -> Model:
        """The model with the effect, named among its effects; itself where the effect is not rendered."""
        if self.apply is None:
            return model
        effects = {**{name: dict(known) for name, known in model.effects.items()}, self.name: dict(keys)}
        return self.apply(model, keys).replaced(effects=effects, path=None)


def unchanged(model: Model, keys: Keys) -> Model:
    """The `apply` of an effect whose law reads the model's keys."""
    return model


def no_keys(values: np.ndarray, scene: TouchedScene, modulus_pa: float) -> dict[str, Any]:
    """The `report` of an effect without parameters."""
    return {}


def check(good: bool, name: str, allowed: str) -> None:
    """Raise ModelError where an effect's keys are impossible."""
    if not good:
        raise ModelError(f"the model's effect {name} is impossible: allowed are {allowed}")
