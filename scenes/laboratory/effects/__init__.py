"""Every effect that the laboratory can write, by the names of the contract and some that it does not have."""

from __future__ import annotations

from palpate.mechanics.errors import OptionError
from palpate.mechanics.names import unknown
from palpate.scenes.laboratory.effects import contact, instrument, solid, stiffness_field
from palpate.scenes.laboratory.effects.base import EffectContext, SensedSamples, SimulatedEffect

REGISTRY: dict[str, SimulatedEffect] = {
    effect.name: effect
    for effect in (
        *solid.EFFECTS,
        *stiffness_field.EFFECTS,
        *contact.EFFECTS,
        *instrument.EFFECTS,
        *contact.UNNAMED,
    )  # fmt: skip
}
"""Effects by name; the order is the order in which they act."""


def effect(name: str) -> SimulatedEffect:
    """The effect of that name; raises OptionError with the allowed names."""
    if name not in REGISTRY:
        raise OptionError(unknown(name, "effect", REGISTRY))
    return REGISTRY[name]


__all__ = ["REGISTRY", "EffectContext", "SimulatedEffect", "SensedSamples", "effect"]
