"""Inclusion: a stiffer (or softer) ball inside. Felt at the places above it.

The give that the ball's elements hold is divided by Eshelby's factor of a spherical inclusion in an
incompressible solid, so that a hard ball does not vanish from the sum: share = 5 (m - 1) / (2 m + 3).
"""

import numpy as np

from diagnose.effects.base import Effect, Parameter
from diagnose.fields import energy_fields, far_with_weights

RATIO_LIMITS = (0.15, 20.0)


def softness(ratio: float) -> float:
    """Factor on the give of the ball's elements for a modulus ratio (Eshelby, nu = 0.5)."""
    return 1 - 5 * (ratio - 1) / (2 * ratio + 3)


def inside(centroid: np.ndarray, centre: np.ndarray, radius: float, blur: float) -> np.ndarray:
    """(m,) share of each element in the ball, with a soft edge of the elements' size."""
    distance = np.linalg.norm(centroid - centre, axis=1)
    return 1 / (1 + np.exp(np.clip((distance - radius) / (0.35 * blur), -40, 40)))


def first_order(values, forward):  # type: ignore[no-untyped-def]
    """(p, 3, 3) 1/m, change of each press's give, unit modulus, to first order in the ball's own energy."""
    fields = energy_fields(forward)
    blur = float(np.cbrt(np.median(fields.volume))) * 1.5
    share = inside(fields.centroid, values[:3], values[3], blur)
    return far_with_weights(forward, 1 + share * (softness(np.exp(values[4])) - 1)) - forward.far


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    change = first_order(values, forward)
    scale = forward.stages.get("inclusion_scale")
    settings.far = settings.far + (change if scale is None else change * scale[:, None, None])


def _starts(forward):  # type: ignore[no-untyped-def]
    """Balls on a grid inside the object, at the two radii and signs whose first-order effect fits best."""
    fields = energy_fields(forward)
    found = forward.stages.get("inclusion_starts")
    return found if found is not None else [np.array([*fields.centroid.mean(axis=0), 0.008, 1.0])]


def _report(values, forward):  # type: ignore[no-untyped-def]
    return {
        "centre_m": [float(v) for v in values[:3]],
        "radius_m": float(values[3]),
        "modulus_ratio": float(np.exp(values[4])),
    }


EFFECT = Effect(
    name="inclusion",
    domain="object",
    words="a harder or softer lump lies inside",
    parameters=(
        *(Parameter(f"centre_{a}_m", "m", -10.0, 10.0, 0.0, (0.0,), 1e-3) for a in "xyz"),
        Parameter("radius_m", "m", 3e-3, 0.03, 8e-3, (8e-3,), 5e-4, 0.006),
        Parameter(
            "log_ratio", "1", np.log(RATIO_LIMITS[0]), np.log(RATIO_LIMITS[1]), 0.0, (1.0, -0.7), 0.05, 1.5
        ),
    ),
    change=_change,
    report=_report,
    needs=("fields",),
    candidates=_starts,
    signature="a few neighbouring places too stiff or too soft",
    # a large soft ball and a small hard one look alike, and first order pulls the place towards the tip
    extra={"systematic": np.array([3e-3, 3e-3, 3e-3, 4e-3, 0.7]), "signed": (4,)},
)
