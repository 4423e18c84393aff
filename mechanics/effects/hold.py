"""How the base of an object is held, as the effects of its model say."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from palpate.mechanics.effects.registry import effects as known_effects
from palpate.mechanics.elastic.held_base import BaseHold


def base_hold(
    effects: Mapping[str, Mapping[str, Any]], normal: np.ndarray, young_modulus_pa: float
) -> BaseHold | None:
    """The base as effects of a model say that it is held; None where it is bonded. normal: (3,) unit."""
    said: dict[str, Any] = {}
    for effect in known_effects():
        if effect.hold is not None and effect.name in effects:
            said |= effect.hold(effects[effect.name], young_modulus_pa)
    if said.get("springs") is None and said.get("bonded_fraction", 1.0) >= 1:
        return None
    return BaseHold(np.asarray(normal, dtype=float), **said)
