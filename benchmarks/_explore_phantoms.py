"""Sealed phantoms of `palpate bench explore`: an object of the pool, a modulus, noise, a cause or none."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.varied.draws import draw
from benchmarks.varied.objects import Thing, thing
from palpate.diagnosis.explore.causes import least_that_matters, projected
from palpate.diagnosis.explore.estimate import ExplorationEstimate, updated
from palpate.diagnosis.explore.explorer import Suggestion
from palpate.diagnosis.explore.segments import join
from palpate.diagnosis.explore.weighing import Weighing, weigh
from palpate.diagnosis.search.limits import SEEN
from palpate.mechanics.errors import SceneError
from palpate.robot import LaboratoryRobot
from palpate.scenes.laboratory.curves import ALONE
from palpate.scenes.laboratory.presses import PlannedTouch
from palpate.scenes.laboratory.session import SimulateOptions, Staging
from palpate.scenes.laboratory.simulate import simulate

OBJECTS = (0, 1, 2, 3, 4, 5, 7, 9, 10, 11, 12, 13, 14, 17, 18)
"""Of the pool; a place of them is solved once and kept."""
CAUSES = (
    "viscoelasticity", "poroelasticity", "time_delay", "backlash", "tool_compliance", "adhesion",
)  # fmt: skip
"""What needs no solid of its own: the places are solved once for all phantoms of an object."""
NONE_EVERY = 3
"""Of so many phantoms one has no effect."""
LEAST, MOST = 2.0, 4.0
"""Times the detectable limit."""
DEPTH = 0.6
"""Of what a place allows, of the presses by which sizes and limits are told."""
STRONGEST = 4.0
"""Of strengths: a cause that would have to be stronger gives way to another."""
REFERENCE = 12
"""Presses, evenly spread, of the exploration by which the limit is told."""


@dataclass(frozen=True)
class Sealed:
    """What is to be found. ratio: the cause's size over its detectable limit in REFERENCE presses; size_n: N
    rms beside the best common factor; limit_n: N. cause: '' for none."""

    seed: int
    number: int
    young_modulus_pa: float
    noise_n: float
    cause: str = ""
    strength: float = 0.0
    ratio: float = 0.0
    size_n: float = 0.0
    limit_n: float = 0.0

    @property
    def effects(self) -> dict[str, float]:
        """As the laboratory is told."""
        return {self.cause: self.strength} if self.cause else {}


def places_of(it: Thing) -> tuple[PlannedTouch, ...]:
    """The straight press of each place."""
    return tuple(place[0] for place in it.places)


def robot_of(sealed: Sealed, effects: dict[str, float] | None = None) -> LaboratoryRobot:
    """The arm on the phantom."""
    it = thing(sealed.number)
    return LaboratoryRobot(
        it.phantom,
        sealed.effects if effects is None else effects,
        seed=sealed.seed,
        options=_options(sealed, it),
        places=places_of(it),
    )


def _options(sealed: Sealed, it: Thing) -> SimulateOptions:
    return SimulateOptions(
        young_modulus_pa=sealed.young_modulus_pa,
        tip_radius_m=it.tip_radius_m,
        force_noise_std_n=sealed.noise_n,
    )


def sealed(seed: int) -> Sealed:
    """The `seed`-th phantom without its strength: modulus and noise as benchmarks.varied draws them."""
    drawn, rng = draw(seed), np.random.default_rng([29, seed])
    number = int(rng.choice(OBJECTS))
    plain = Sealed(seed, number, drawn.young_modulus_pa, drawn.noise_n)
    if seed % NONE_EVERY == 0:
        return plain
    ratio = float(np.exp(rng.uniform(np.log(LEAST), np.log(MOST))))
    return replace(plain, cause=str(rng.choice(CAUSES)), ratio=ratio)


def strengthened(it: Sealed) -> Sealed:
    """The phantom with its cause as strong as its ratio says. Raises PalpateError where it cannot be told."""
    if not it.cause:
        return it
    limits = limits_of(it)
    causes = np.random.default_rng([31, it.seed]).permutation([c for c in CAUSES if c != it.cause])
    for cause in (it.cause, *map(str, causes)):
        limit, strength = limits.get(cause, np.inf), 1.0
        for _ in range(2):
            size = size_at(replace(it, cause=cause), strength)
            strength = float(np.clip(strength * it.ratio * limit / max(size, 1e-6), 1e-3, 2 * STRONGEST))
        if strength <= STRONGEST:
            made = replace(it, cause=cause, strength=strength, limit_n=limit)
            size = size_at(made, strength)
            return replace(made, size_n=size, ratio=size / limit)
    raise SceneError(f"no cause up to strength {STRONGEST:g} is {it.ratio:.1f} times what shows")


def limits_of(it: Sealed) -> dict[str, float]:
    """{cause: N rms}, the smallest size that shows in REFERENCE evenly spread presses of the object without
    it."""
    body = thing(it.number)
    robot = robot_of(it, {})
    segments = [robot.carry_out(Suggestion("trace", ""))]
    for touch in places_of(body)[:REFERENCE]:
        depth = 1e-3 * DEPTH * touch.reach
        to = Suggestion("press", "", 1e-3 * touch.point, touch.normal, depth, speed_m_per_s=0.02, hold_s=0.2)
        segments.append(robot.carry_out(to))
    recording = join(robot.instrument, segments)
    weighing = weigh(updated(recording, ExplorationEstimate(), robot.phantom.poisson_ratio, it.seed))
    return _detectable_n(weighing) if weighing else {}


def size_at(it: Sealed, strength: float) -> float:
    """N rms of the cause in one press of each of eight places, a common factor taken off."""
    body = thing(it.number)
    touches = tuple(replace(t, depth=DEPTH * t.reach) for t in places_of(body)[:8])
    made = simulate(
        body.phantom,
        {it.cause: strength},
        _options(it, body),
        seed=it.seed,
        staging=Staging(touches=touches),
        solving=ALONE,
    )
    sizes: dict[str, Any] = made.truth["sizes"]
    return float(sizes[it.cause]["rms_after_best_scale_n"])


def _detectable_n(weighing: Weighing) -> dict[str, float]:
    """{cause: N rms over contact samples beside the modulus} of the smallest size that shows in these
    presses, in the form that shows best, and matters."""
    _, curve, _ = projected(weighing)
    inflation = weighing.forward.touches.noise.variance_inflation
    shows = SEEN * np.sqrt(inflation) * weighing.sizes / np.sqrt(np.maximum(curve, 1e-300))
    matters = least_that_matters(weighing.forward)
    names = dict.fromkeys(weighing.names)
    return {n: max(matters, float(shows[[m == n for m in weighing.names]].min())) for n in names}
