"""What an effect of the laboratory is: a name, the meaning of its strength, and the places where it acts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.scenes.laboratory.hand_path import Motion
from palpate.scenes.laboratory.presses import PlannedTouch
from palpate.scenes.laboratory.specimen import Specimen
from palpate.scenes.phantoms import Phantom

Parameters = Mapping[str, Any]


@dataclass(frozen=True)
class EffectContext:
    """What an effect may look at to choose its parameters: the ideal object, the touches, and
    its own chance.
    """

    phantom: Phantom
    modulus_pa: float
    tip_radius_m: float
    touches: tuple[PlannedTouch, ...]
    rng: np.random.Generator


@dataclass(frozen=True)
class SensedSamples:
    """Samples as instruments see them, device frame, SI: t (n,), position (n, 3), force on the tool (n, 3),
    axes (n, 3, 3): tool frame to device frame. second: (n,) bool, phase II.
    """

    t: np.ndarray
    position: np.ndarray
    force: np.ndarray
    axes: np.ndarray
    second: np.ndarray


@dataclass(frozen=True)
class SimulatedEffect:
    """One departure from the ideal model.

    parameters(strength, bench): the keys of the contract, SI. in_solid(specimen, parameters): solved in
    the solid. on_force(force, motion, normals, parameters): acts on the elastic force (n, 3) N, object
    frame. on_readings( readings, parameters): acts in the instrument. on_shape(phantom, parameters):
    changes the object's surface.
    needs_finite: whether it has no meaning at small strains. least_strength: below 0 where it may be the
    other way round. forgets: a touch feels it alike whatever was touched long before.
    """

    name: str
    domain: str
    parameters: Callable[[float, EffectContext], dict[str, Any]]
    in_solid: Callable[[Specimen, Parameters], Specimen] | None = None
    on_force: Callable[[np.ndarray, Motion, np.ndarray, Parameters], np.ndarray] | None = None
    on_readings: Callable[[SensedSamples, Parameters], SensedSamples] | None = None
    on_shape: Callable[[Phantom, Parameters], Phantom] | None = None
    needs_finite: bool = False
    least_strength: float = 0.0
    forgets: bool = False


def unit(rng: np.random.Generator) -> np.ndarray:
    """A random unit vector."""
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)
