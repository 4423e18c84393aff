"""Skin: a stiffer (or softer) layer all over the surface, felt most by shallow dents.

The dent's modulus follows Gao's weight of a film under a punch of the contact's radius (Gao, Chiu, Lee 1992).
"""

import numpy as np

from diagnose.effects.base import Effect, Parameter
from diagnose.fields import energy_fields, far_with_weights
from mechanics.effects.skin_layer import film_factor


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    thickness, ratio = values[0], np.exp(values[1])
    contact = forward.tip_radius * np.sqrt(np.maximum(forward.dents, 1e-6))
    own = film_factor(contact, thickness, ratio, settings.nu)
    settings.scale_table(own, own)
    fields = energy_fields(forward)
    # only what lies deeper than the dent's own reach counts as far field
    inside = np.clip(thickness / np.maximum(fields.depth, 1e-6), 0, 1) * (fields.depth < 2 * thickness)
    settings.far = settings.far + 0.3 * (
        far_with_weights(forward, 1 + inside * (1 / ratio - 1)) - forward.far
    )


def _report(values, forward):  # type: ignore[no-untyped-def]
    return {"thickness_m": float(values[0]), "modulus_ratio": float(np.exp(values[1]))}


EFFECT = Effect(
    name="skin_layer",
    domain="object",
    words="a skin of another stiffness covers the object",
    parameters=(
        Parameter("thickness_m", "m", 3e-4, 8e-3, 3e-3, (2e-3, 2e-3), 2e-4),
        Parameter("log_ratio", "1", -2.0, 3.0, 0.0, (0.5, -0.4), 0.03),
    ),
    change=_change,
    report=_report,
    needs=("fields",),
    signature="stiff at first touch, less so deeper, everywhere alike",
)
