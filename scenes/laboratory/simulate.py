"""A whole recording: phantom, effects and a hand in; samples and the truth about them out."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.errors import OptionError
from palpate.mechanics.recording.recording import Recording, read_recording, write_recording
from palpate.mechanics.result import Result
from palpate.scenes.laboratory.curves import EVERY_CORE, Solving
from palpate.scenes.laboratory.effects import REGISTRY, EffectContext, SensedSamples, effect
from palpate.scenes.laboratory.hand_path import Motion
from palpate.scenes.laboratory.presses import PlannedTouch, press_set
from palpate.scenes.laboratory.session import Session, SimulateOptions, Staging
from palpate.scenes.laboratory.truth import truth_of
from palpate.scenes.phantoms import Phantom


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Result):
    """A recording of the virtual laboratory and the truth about it; goes wherever a recording goes.

    body: the phantom as it was explored. `clean_n` (n, 3) N is the force on the tool without noise, device
    frame; `readings` are it with the true positions beside, before noise and rounding; `motion` is the
    hand's true way, object frame. `ideal_n` (n, 3): where asked for, what the ideal
    object would have answered to the same way. `plot`: force over time. `show`: the tip's path.
    """

    recording: Recording
    truth: Mapping[str, Any]
    clean_n: np.ndarray
    touches: tuple[PlannedTouch, ...]
    motion: Motion
    readings: SensedSamples
    ideal_n: np.ndarray | None = None
    body: Phantom | None = None

    @property
    def phantom(self) -> str:
        """The name of what was explored."""
        return "object" if self.body is None else Path(self.body.name).name

    def save(self, path: Path | str) -> Simulation:
        """Write the recording with its truth; returns the simulation whose recording knows its file."""
        written = write_recording(path, self.recording, truth=self.truth)
        return replace(self, recording=read_recording(written))


def simulate(
    phantom: Phantom,
    effects: Mapping[str, float] | None = None,
    options: SimulateOptions | None = None,
    *,
    seed: int = 0,
    sizes: bool = True,
    ideal: bool = False,
    staging: Staging | None = None,
    solving: Solving = EVERY_CORE,
) -> Simulation:
    """Explore `phantom` with `effects` (name: strength, see INTERFACE of the docs) and write down what is
    read.

    The ideal model has no effect: linear elastic, bonded, sticking, exact but for noise. Regions of the
    phantom count as the effect `inclusion`. seed: timing, straying, tracing and noise; the press set has
    its own number, so that solved curves are shared. sizes: also solve without each effect, to state its
    size. staging: lay down hand, touches, frame or instrument. Raises OptionError, LabError.
    """
    options = options or SimulateOptions()
    strengths = {name: float(value) for name, value in (effects or {}).items() if float(value) != 0}
    for name, value in strengths.items():
        least = effect(name).least_strength
        if not (np.isfinite(value) and value != 0 and least <= value <= 16):
            above = f"at least {least:g}, not 0," if least else "greater than 0"
            raise OptionError(f"effect '{name}' has strength {value}; it must be {above} and at most 16")
    if any(effect(name).needs_finite for name in strengths):
        strengths.setdefault("finite_strain", 1.0)
    staging = staging or Staging()
    modulus = options.young_modulus_pa or phantom.young_modulus_pa
    plain = replace(phantom, regions=())
    touches = staging.touches or tuple(press_set(plain, options.protocol, options.presses))
    parameters = _parameters(plain, strengths, modulus, options, touches)
    session = Session(phantom, modulus, options, touches, parameters, seed, staging, solving)
    present = tuple(parameters)
    whole, clean = session.run(present)
    truth = truth_of(session, present, clean, whole, sizes, strengths)
    recording, way = session.recording(whole, clean, truth), session.way
    plain_n = session.run((), regions=False)[1] if ideal else None
    return Simulation(recording, truth, clean, touches, way, whole, plain_n, phantom)


def _parameters(
    phantom: Phantom,
    strengths: Mapping[str, float],
    modulus: float,
    options: SimulateOptions,
    touches: Sequence[PlannedTouch],
) -> dict[str, dict[str, Any]]:
    out = {}
    for name in sorted(strengths, key=list(REGISTRY).index):
        rng = np.random.default_rng([options.presses, zlib.crc32(name.encode())])
        bench = EffectContext(phantom, modulus, options.tip_radius_m, tuple(touches), rng)
        out[name] = effect(name).parameters(strengths[name], bench)
    return out
