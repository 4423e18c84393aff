"""The numerical effects: one line each; an effect is diagnose/numerics/NAME.py."""

from __future__ import annotations

import importlib

from palpate.diagnosis.numerics.base import NumericalEffect
from palpate.mechanics.errors import OptionError

NAMES = (
    "contact_stiffness",
    "contact_nodes",
    "contact_offset",
    "mesh_stiffness",
    "force_law",
    "numerical_damping",
    "time_step",
    "lost_contact",
    "tunnelling",
    "numerical_drift",
)


def numerical(name: str) -> NumericalEffect:
    """The effect of that name; raises OptionError for an unknown one."""
    if name not in NAMES:
        raise OptionError(f"'{name}' is no numerical effect; allowed are {', '.join(NAMES)}")
    return importlib.import_module(f"palpate.diagnosis.numerics.{name}").EFFECT


def numericals() -> tuple[NumericalEffect, ...]:
    """All of them."""
    return tuple(numerical(name) for name in NAMES)
