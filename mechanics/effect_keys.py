"""The keys of every effect, as a model's [effects.NAME] may hold them: type, range, unit."""

from __future__ import annotations

from mechanics.recording import POISSON
from mechanics.schema import Key, Schema

_VECTOR = 3
LENGTH = Key(low=1e-5, high=1.0, unit="m", required=True)
RATIO = Key(low=1e-3, high=1e3, required=True)
PLACE = Key(low=-10.0, high=10.0, size=_VECTOR, unit="m", required=True)
BALL: Schema = {"centre_m": PLACE, "radius_m": LENGTH, "modulus_ratio": RATIO}
GRADIENT: Schema = {"ratio_base": RATIO, "ratio_top": RATIO}
SKIN: Schema = {"thickness_m": LENGTH, "modulus_ratio": RATIO}

EFFECT_KEYS: dict[str, Schema] = {
    "finite_strain": {},
    "strain_stiffening": {"c20_over_c10": Key(low=0.0, high=100.0, required=True)},
    "viscoelasticity": {
        "g": Key(low=0.0, high=100.0, size=0, required=True),
        "tau_s": Key(low=1e-6, high=1e5, size=0, unit="s", required=True),
    },
    "mullins_softening": {
        "r": Key(low=1.0, high=1e9, required=True),
        "m_rel": Key(low=1e-6, high=1e3, required=True),
    },
    "poisson_ratio": {"poisson_ratio": Key(low=POISSON.low, high=POISSON.high, required=True)},
    "inclusion": BALL,
    "modulus_gradient": GRADIENT,
    "skin_layer": SKIN,
    "stiffness_field": {
        "places_m": None,
        "ratio": Key(low=1e-3, high=1e3, size=0, required=True),
        "length_m": LENGTH,
    },
    "surface_shape": {"rms_m": Key(low=0.0, high=1.0, unit="m"), "where": None},
    "unbonded_base": {
        "bonded_fraction": Key(low=1e-3, high=1.0, required=True),
        "direction": Key(low=-1e3, high=1e3, size=_VECTOR, required=True),
    },
    "compliant_base": {
        "k_normal_pa_per_m": Key(low=1.0, high=1e15, unit="Pa/m", required=True),
        "k_tangential_pa_per_m": Key(low=1.0, high=1e15, unit="Pa/m", required=True),
    },
    "surface_offset": {
        "shift_m": Key(low=-1.0, high=1.0, size=_VECTOR, unit="m", required=True),
        "rotation_rad": Key(low=-4.0, high=4.0, size=_VECTOR, unit="rad", required=True),
    },
    "tip_radius": {"tip_radius_m": Key(low=1e-5, high=0.1, unit="m", required=True)},
    "friction_slip": {"mu": Key(low=0.0, high=100.0, required=True)},
    "adhesion": {
        "pull_off_n": Key(low=0.0, high=100.0, unit="N", required=True),
        "range_m": Key(low=1e-6, high=0.1, unit="m", required=True),
        "inside": Key(low=0.0, high=1.0),
    },
    "tool_compliance": {"stiffness_n_per_m": Key(low=1.0, high=1e12, unit="N/m", required=True)},
    "force_bias": {"bias_n": Key(low=-1e3, high=1e3, size=_VECTOR, unit="N", required=True)},
    "force_drift": {"rate_n_per_s": Key(low=-1e3, high=1e3, size=_VECTOR, unit="N/s", required=True)},
    "force_gain": {"matrix": None},
    "tool_gravity_inertia": {
        "mass_kg": Key(low=-5.0, high=5.0, unit="kg", required=True),
        "tared": Key(bool),
    },
    "time_delay": {"delay_s": Key(low=-10.0, high=10.0, unit="s", required=True)},
    "backlash": {"width_m": Key(low=0.0, high=0.1, unit="m", required=True)},
}
