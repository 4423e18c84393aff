"""One table of our own errors: every number says what it is and whence, and options default to it."""

from __future__ import annotations

import inspect
from dataclasses import fields
from typing import get_args

from palpate.diagnosis.options import NuisanceOptions
from palpate.mechanics import law_errors
from palpate.mechanics.law_errors import (
    DepthLaw,
    Direction,
    FirstTouch,
    Latency,
    Level,
    OwnError,
    Reach,
    Repeats,
    Slip,
    Stiffness,
    Unnamed,
)
from palpate.mechanics.quantities import parse_unit
from palpate.reconstruction.steps.s7_modulus.modulus import ModulusOptions


def test_every_number_states_its_unit_what_it_is_of_and_its_source():
    classes = [
        c for c in vars(law_errors).values() if inspect.isclass(c) and c.__module__ == law_errors.__name__
    ]
    for error in (c for c in classes if c is not OwnError):
        for name, entry in ((k, v) for k, v in vars(error).items() if not k.startswith("_")):
            assert isinstance(entry, OwnError), (error, name)
            parse_unit(entry.unit)
            assert entry.value >= 0, name
            assert entry.of and entry.source and entry.reach in get_args(Reach), name


def test_options_default_to_the_table():
    defaults = {
        NuisanceOptions: {
            "onset_m": FirstTouch.diagnosis,
            "fitted_onset_m": FirstTouch.fitted,
            "fitted_onset_share": FirstTouch.fitted_share,
            "common_onset_m": FirstTouch.fitted_common,
            "common_stick": Slip.level,
            "shallow_stick": Slip.shallow,
            "site_stiffness": Stiffness.diagnosis,
            "law_bound": Stiffness.bound,
            "surface": Stiffness.surface,
            "press_stiffness": Repeats.diagnosis,
            "tilt": Direction.diagnosis,
            "stick": Slip.diagnosis,
            "leaning": Slip.leaning,
            "law": DepthLaw.diagnosis,
            "latency_s": Latency.diagnosis,
            "floor_share": Unnamed.share,
            "floor_along": Unnamed.along,
            "floor_n": Unnamed.force,
        },
        ModulusOptions: {"law_error": DepthLaw.modulus, "law_bias": Level.modulus},
    }
    assert set(defaults[NuisanceOptions]) == {f.name for f in fields(NuisanceOptions)}
    for options, entry_of in defaults.items():
        for field in fields(options):
            if field.name in entry_of:
                entry = entry_of[field.name]
                assert field.default == entry.value and (field.metadata["unit"] or "1") == entry.unit
