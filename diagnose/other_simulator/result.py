"""What mends a simulation, in words: a line for each that is named.

The gap of another simulator: the answers of a diagnosis, and the three parts that the gap is made of.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.diagnosis.numerics.registry import numerical
from palpate.diagnosis.other_simulator.against_law import Numerics
from palpate.diagnosis.other_simulator.declared_parameters import Stated
from palpate.diagnosis.other_simulator.frame import AS_RECORDED
from palpate.diagnosis.other_simulator.gap_decomposition import StatedParameter
from palpate.diagnosis.search.rivals import Explanation
from palpate.diagnosis.verdict.result import Diagnosis, EffectEntry, answers_json
from palpate.diagnosis.verdict.where import Where
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.result import Key, Result, figures_of

_MEANT = {
    "stated_modulus": ("Young's modulus", "Pa"),
    "stated_poisson_ratio": ("Poisson's ratio", ""),
    "stated_friction": ("friction", ""),
    "stated_tip_radius": ("the tip's radius", "m"),
}


def advice_of(
    numerics: Numerics,
    wrong: Sequence[StatedParameter],
    real: Sequence[str],
    own_words: Mapping[str, str],
    *,
    unstated: bool,
    poisson_limit: float,
) -> tuple[str, ...]:
    """own_words: by numerical effect, in that simulator's words. real: effects that only a model with them
    has. unstated: a stiffness may be a modulus that nobody stated."""
    said = []
    if unstated:
        said.append(
            "stated modulus: what the simulator was given is not stated, and forces do not part it from the "
            "mesh's stiffness; give --stated young_modulus_pa=PA"
        )
    for name in (*numerics.named, *numerics.candidates):
        words = numerical(name).advised(numerics.keys[name], own_words.get(name, ""))
        which = "" if name in numerics.named and not (unstated and name == "mesh_stiffness") else "or "
        said.append(f"{which}{name.replace('_', ' ')}: {words}")
    said += [f"{p.name.replace('_', ' ')}: {parameter_words(p, poisson_limit)}" for p in wrong]
    for name in real:
        said.append(
            f"{name.replace('_', ' ')}: no setting of an ideal elastic simulation contains it; "
            "'palpate diagnose REC --model MODEL --apply MODEL2' writes a model that does"
        )
    return tuple(said)


def parameter_words(wrong: StatedParameter, poisson_limit: float = math.inf) -> str:
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


PARTS = ("numerics", "parameters", "reality")
"""In the order in which they are taken off."""


@dataclass(frozen=True)
class Simulator:
    """Whose forces they are. version: "" where it is not known. axes, unit: of its file
    (`other_simulator.frame`)."""

    name: str
    version: str
    stated: Stated
    axes: str = AS_RECORDED
    unit: str = "N"

    def as_json(self) -> dict[str, Any]:
        """The contract's keys; `given`: which of `stated` were said, the others are the model's."""
        return {
            "name": self.name,
            "version": self.version,
            "stated": self.stated.as_json(),
            "given": sorted(self.stated.given),
            "frame": self.axes,
            "unit": self.unit,
        }


@dataclass(frozen=True)
class GapPart:
    """gap_n: N rms that it adds to the gap. share: of the mean square of the gap (below 0: it hides
    others). names: of the effects in it, strongest first."""

    gap_n: float
    share: float
    names: tuple[str, ...] = field(default=(), metadata={"json": "effects"})


@dataclass(frozen=True)
class Mended:
    """The same simulator, run once more. settings: in words. gap_n: N rms, to the measured force. effects:
    what is named of it still."""

    settings: str
    gap_n: float
    effects: tuple[str, ...]


@dataclass(frozen=True)
class OwnFlaws:
    """What a simulator has of its own at its best settings: names, what else it may be, and N rms off our
    law."""

    effects: tuple[str, ...]
    candidates: tuple[str, ...]
    off_n: float


@dataclass(frozen=True)
class MadeUp:
    """Two errors that make up for each other: N rms that each alone and both together change the force by."""

    effects: tuple[str, str]
    alone_n: tuple[float, float]
    together_n: float


@dataclass(frozen=True, eq=False, repr=False)
class SimulatedGap(Result):
    """Where, why and how far another simulator's force leaves the measured one. Gaps: N, rms of the 3-vector
    over contact samples, the parts at places that their fits have not seen.

    explanations: the smallest collection of sets of causes that holds nine tenths of the posterior, the
    likeliest first. parts: by name of PARTS; unexplained: the share that is left, unexplained_n in N; of it
    noise_share is the sensor's noise and touch_share what the object's own first touches take. effects: what
    changes the force most first. reality: today's diagnosis of our ideal model. gaps: (n, 3) N, local frames
    of `touches`, as the parts are taken off, "simulated" first. notes: what was told of the forces. mended:
    where it was run again. own: what it has of its own at its best settings, where that was given; made_up:
    pairs of errors of which one hides the other. coarse: that its rows are too far apart for a verdict, in
    words, or ''. `plot`: the parts as shares. `show`: the object coloured by
    the gap.
    """

    simulator: Simulator
    noise_n: float
    gap_before_n: float
    gap_after_n: float
    gap_closed: float | None
    gap_closed_ci95: tuple[float, float] | None
    kind: str
    effects: tuple[str, ...]
    candidates: tuple[str, ...]
    explanations: tuple[Explanation, ...]
    parts: Mapping[str, GapPart]
    unexplained: float
    unexplained_n: float
    noise_share: float
    touch_share: float
    where: Where
    entries: tuple[EffectEntry, ...]
    young_modulus_pa: float
    advice: tuple[str, ...]
    notes: tuple[str, ...]
    reasons: tuple[str, ...]
    reality: Diagnosis
    touches: Presses
    gaps: Mapping[str, np.ndarray] = field(default_factory=dict)
    simulated: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    mended: Mended | None = None
    own: OwnFlaws | None = None
    made_up: tuple[MadeUp, ...] = ()
    coarse: str = ""

    @property
    def body_alone(self) -> bool:
        """Whether the whole body is too stiff or too soft, and forces alone do not tell by its modulus, which
        nobody stated, or by its mesh."""
        return "mesh_stiffness" in self.effects and "stated_modulus" in self.candidates

    @property
    def without_numerics_n(self) -> float:
        """N, the gap that is left once the numerics alone are mended, as it is said before that is run."""
        return self.gap_before_n * math.sqrt(max(1 - self.parts["numerics"].share, 0.0))

    def as_json(self) -> dict[str, Any]:
        """The contract's keys, and some more."""
        return {**answers_json(self, self.reality.next_touch), **figures_of(self, _KEYS)}


_KEYS: tuple[Key, ...] = (
    "simulator",
    ("parts", lambda gap: {name: gap.parts[name] for name in ("reality", "parameters", "numerics")}),
    "unexplained",
    "unexplained_n",
    ("unexplained_of", lambda gap: {"noise": gap.noise_share, "first_touches": gap.touch_share}),
    "advice",
    "notes",
    "reasons",
    ("gap_after_measured_n", lambda gap: None if gap.mended is None else gap.mended.gap_n),
    "gap_without_numerics_n=without_numerics_n",
    "mended",
    "own",
    "made_up",
    "ideal=reality",
)
