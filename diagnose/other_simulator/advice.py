"""What mends a simulation, in words: a line for each that is named."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from palpate.diagnosis.numerics.registry import numerical
from palpate.diagnosis.other_simulator.against_law import Numerics
from palpate.diagnosis.other_simulator.parts import Parameter

_MEANT = {
    "stated_modulus": ("Young's modulus", "Pa"),
    "stated_poisson_ratio": ("Poisson's ratio", ""),
    "stated_friction": ("friction", ""),
    "stated_tip_radius": ("the tip's radius", "m"),
}


def advice_of(
    numerics: Numerics,
    wrong: Sequence[Parameter],
    real: Sequence[str],
    own_words: Mapping[str, str],
    *,
    unstated: bool,
    poisson_limit: float,
) -> tuple[str, ...]:
    """own_words: by numerical effect, in that simulator's words. real: effects that only a model with them
    has. unstated: a stiffness may be a modulus that nobody stated."""
    said = []
    for name in (*numerics.named, *numerics.candidates):
        words = own_words.get(name) or numerical(name).advice
        which = "" if name in numerics.named else "or "
        said.append(f"{which}{name.replace('_', ' ')}: {words}")
    if unstated:
        said.append("or stated modulus: nobody said what it was given; say it: --stated young_modulus_pa=PA")
    said += [f"{p.name.replace('_', ' ')}: {parameter_words(p, poisson_limit)}" for p in wrong]
    for name in real:
        said.append(
            f"{name.replace('_', ' ')}: no setting of an ideal elastic simulation has it; "
            "'palpate diagnose REC --apply MODEL2' writes a model that does"
        )
    return tuple(said)


def parameter_words(wrong: Parameter, poisson_limit: float = math.inf) -> str:
    """What to give a simulator whose Poisson's ratio may be no greater than that."""
    what, unit = _MEANT[wrong.name]
    now = f"{wrong.measured:.4g} {unit}".strip()
    if not math.isfinite(wrong.measured):
        now = "infinite: the tip sticks"
    limit = poisson_limit if wrong.name == "stated_poisson_ratio" else math.inf
    if wrong.measured <= limit or not math.isfinite(wrong.measured):
        return f"give it {now} for {what} (it had {wrong.stated:.4g} {unit})".replace(" )", ")")
    if wrong.stated < limit:
        return f"give it {limit:g} for {what}, the most that it takes (the recording says {now})"
    return f"the recording says {now}, and {limit:g} is the most that it takes: this part stays"
