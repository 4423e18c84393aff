"""Tool compliance: a spring between the position sensor and the tip. Felt more where the object is stiff."""

from diagnose.effects.base import Effect, Parameter


def _change(settings, values, forward):  # type: ignore[no-untyped-def]
    settings.tool_give = values[0]


EFFECT = Effect(
    name="tool_compliance",
    domain="instrument",
    words="the tool bends: the tip is not where the position sensor says",
    parameters=(Parameter("give_m_per_n", "m/N", 0.0, 0.01, 0.0, (5e-4,), 5e-5),),
    change=_change,
    report=lambda values, forward: {"stiffness_n_per_m": float(1 / max(values[0], 1e-9))},
    signature="every press too soft by the same depth a newton, in all directions",
)
