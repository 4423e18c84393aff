"""The registry of effects: one line each, the contract's order; an effect is mechanics/effects/NAME.py."""

from __future__ import annotations

import importlib

from palpate.mechanics.disk.schema import Schema
from palpate.mechanics.effects.base import Effect
from palpate.mechanics.errors import OptionError
from palpate.mechanics.names import unknown

NAMES = (
    "finite_strain",
    "strain_stiffening",
    "viscoelasticity",
    "power_law_relaxation",
    "poroelasticity",
    "mullins_softening",
    "poisson_ratio",
    "inclusion",
    "modulus_gradient",
    "skin_layer",
    "stiffness_field",
    "surface_shape",
    "unbonded_base",
    "compliant_base",
    "surface_offset",
    "tip_radius",
    "friction_slip",
    "adhesion",
    "jkr_adhesion",
    "tool_compliance",
    "force_bias",
    "force_drift",
    "force_gain",
    "tool_gravity_inertia",
    "time_delay",
    "backlash",
)


def known(name: str) -> None:
    """Raise OptionError for a name that no effect has."""
    if name not in NAMES:
        raise OptionError(unknown(name, "effect", NAMES))


def effect(name: str) -> Effect:
    """The effect of that name; raises OptionError for an unknown one."""
    known(name)
    return importlib.import_module(f"palpate.mechanics.effects.{name}").EFFECT


def effects(*, without: frozenset[str] | set[str] = frozenset()) -> tuple[Effect, ...]:
    """All effects but those named; raises OptionError where one of these is unknown."""
    for name in without:
        known(name)
    return tuple(effect(name) for name in NAMES if name not in without)


def effect_keys() -> dict[str, Schema | None]:
    """What a model's [effects.NAME] may hold, by name."""
    return {each.name: each.keys for each in effects()}
