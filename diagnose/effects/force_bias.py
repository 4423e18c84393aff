"""Force bias: a constant vector on every reading, seen best in free air."""

from diagnose.effects.base import Effect, Parameter


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    settings.bias = values.copy()


EFFECT = Effect(
    name="force_bias",
    domain="instrument",
    words="the force sensor does not read zero in free air",
    parameters=tuple(Parameter(f"bias_{a}_n", "N", -2.0, 2.0, 0.0, (0.0,), 0.005) for a in "xyz"),
    change=_change,
    report=lambda values, forward: {"bias_n": [float(v) for v in values]},
    signature="constant in free air, fixed in the device frame",
)
