"""What a diagnosis changes: the model (object, contact, boundary effects) or the recording (instrument
effects)."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from palpate.diagnosis.search.attribution import Attribution
from palpate.diagnosis.search.fit import covariance
from palpate.mechanics.effects.base import Role
from palpate.mechanics.effects.registry import effect, effects
from palpate.mechanics.law_errors import Level
from palpate.mechanics.model.material import UNKNOWN
from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import Recording

WORSE = 0.02
"""Share of the given model's gap: replays that differ by less are alike."""
REPLAYS = 2
"""Of the modulus's refit: a force goes with the modulus but for friction and adhesion."""


class Verdict(Protocol):
    """What is read of a diagnosis: the effects that it asserts, every effect's name and parameters (entries),
    the modulus (Pa) fitted with them, the search."""

    @property
    def effects(self) -> tuple[str, ...]: ...

    @property
    def entries(self) -> Sequence[Any]: ...

    @property
    def young_modulus_pa(self) -> float: ...

    @property
    def attribution(self) -> Attribution | None: ...


def improved(model: Model, diagnosis: Verdict, without: Sequence[str] = ()) -> tuple[Model, list[str]]:
    """(model with the asserted effects, their names). Instrument effects are left out: they must not be
    rendered; so are those of `without`.

    The modulus with its interval, and the dent law that is rendered, are those of the diagnosis's own fit;
    see `with_replayed_modulus`.
    """
    modulus, interval = diagnosis.young_modulus_pa, UNKNOWN
    parameters = {e.name: dict(e.parameters) for e in diagnosis.entries}
    asserted = {name: parameters.get(name, {}) for name in diagnosis.effects if name not in without}
    provenance = {**model.provenance, "diagnosed_effects": list(asserted)}
    if diagnosis.attribution is not None:
        final = diagnosis.attribution.final
        sd = np.hypot(np.sqrt(covariance(final.found, final.dof)[0, 0]), Level.modulus.value)
        interval = float(modulus * np.exp(-1.96 * sd)), float(modulus * np.exp(1.96 * sd))
        # known physics that the fit did without is left out of the model as well
        fitted = diagnosis.attribution.final.found.names
        held = {*fitted, *diagnosis.effects, *model.effects}
        model = model.with_material(dent_law="linear")
        for each in effects():
            if each.role is Role.KNOWN and each.name in held and each.apply is not None:
                model = each.apply(model, {})
    levelled = model.with_material(young_modulus_pa=modulus, young_modulus_ci95_pa=interval)
    better = with_effects(levelled, asserted)
    better = better.replaced(provenance=provenance)
    return better, [name for name in asserted if effect(name).rendered]


def with_replayed_modulus(model: Model, recording: Recording) -> Model:
    """The model with the Young's modulus at which the renderer's own replay meets the recording best.

    A fit moves first touches and sites' stiffnesses beside the modulus, which a renderer cannot; what they
    leave to the modulus is made good here, by the median over presses: one drag that the model misses must
    not decide. Its interval goes with it. recording: read right (`corrected`). Where the replay gives no
    force the model stays.
    """
    from palpate.render.registry import create
    from palpate.render.replay import replay_recording

    counted = model.presses.touching(recording.t)
    begins = np.flatnonzero(np.diff(np.concatenate([[False], counted])) & counted)
    if not len(begins):
        return model
    measured = recording.force_on_tool
    renderer, modulus = create("fem", model, on_demand=True), model.material.young_modulus_pa
    for _ in range(REPLAYS):
        forces = np.where(counted[:, None], replay_recording(renderer, recording, checked=False), 0.0)
        meets = np.add.reduceat((forces * measured).sum(axis=1), begins)
        power = np.add.reduceat((forces**2).sum(axis=1), begins)
        felt = power > 0
        if not felt.any():
            return model
        modulus *= float(np.median(meets[felt] / power[felt]))
        renderer = renderer.with_modulus(modulus)
    low, high = np.array(model.material.young_modulus_ci95_pa) * modulus / model.material.young_modulus_pa
    return model.with_material(young_modulus_pa=modulus, young_modulus_ci95_pa=(float(low), float(high)))


@dataclass(frozen=True)
class Improvement:
    """An improved model, and what the renderer's replay of the diagnosed recording says of it.

    given_n, improved_n: N rms of the force's 3-vector while pressing, of the model that was given and of this
    one. left_out: asserted effects that it does without, as its force would be farther off with them.
    unsettled: samples of both replays, of so many (`samples`), whose force did not settle: the one before
    stands there.
    """

    model: Model
    given_n: float
    improved_n: float
    left_out: tuple[str, ...] = ()
    unsettled: int = 0
    samples: int = 0


def improvement(model: Model, diagnosis: Verdict, recording: Recording) -> Improvement:
    """The model with the asserted effects, or without those with which its replay is worse than the given
    model's: a fit may have moved first touches beside an effect, which a renderer cannot.

    recording: read right (`corrected`).
    """
    given_n, held = replayed_gap(model, recording)

    def without(names: Sequence[str]) -> Improvement:
        better = with_replayed_modulus(improved(model, diagnosis, names)[0], recording)
        improved_n, own = replayed_gap(better, recording)
        return Improvement(better, given_n, improved_n, tuple(names), held + own, 2 * len(recording.t))

    rendered, found = improved(model, diagnosis)[1], without(())
    while found.improved_n > given_n * (1 + WORSE) and rendered:
        tried = [without((*found.left_out, name)) for name in rendered]
        found = min(tried, key=lambda each: each.improved_n)
        rendered.remove(found.left_out[-1])
    return found


def replayed_gap(model: Model, recording: Recording) -> tuple[float, int]:
    """(N rms of measured less rendered force while pressing, nan where the recording has no press; samples
    whose force did not settle)."""
    from palpate.render.registry import create
    from palpate.render.replay import replay_error, replay_recording

    held: list[int] = []
    forces = replay_recording(
        create("fem", model, on_demand=True), recording, unsettled=held.append, checked=False
    )
    return replay_error(recording, model.presses, forces).rmse_n, sum(held)


def with_effects(model: Model, named: Mapping[str, Mapping[str, Any]]) -> Model:
    """The model with these effects, by the contract's keys (SI, device frame), over those that it has.

    All go to [effects.NAME]; what of one is material goes into the material, where it counts. Effects of the
    instrument, and those that do not say what the model should be, are left out.
    """
    for name, keys in named.items():
        model = effect(name).applied(model, keys)
    return model


def unsure(diagnosis: Verdict) -> tuple[str, ...]:
    """Asserted effects of the instrument that are smaller than twice their own error: the 95 % interval of
    each of their parameters holds what a right instrument has (0, or 1 on a matrix's diagonal)."""
    found = []
    for entry in diagnosis.entries:
        if entry.name in diagnosis.effects and effect(entry.name).correct is not None and entry.intervals:
            held = [
                (low <= right) & (right <= high)
                for low, high in (np.asarray(each, float) for each in entry.intervals.values())
                for right in (np.eye(3) if low.shape == (3, 3) else np.zeros(low.shape),)
            ]
            found += [entry.name] if all(each.all() for each in held) else []
    return tuple(found)


def corrected(recording: Recording, diagnosis: Verdict) -> Recording:
    """The recording with asserted instrument effects taken off, what the instrument does last first.

    Those that cannot be taken off, and those that are smaller than twice their error (`unsure`), stay. Times
    keep their samples.
    """
    parameters = {e.name: e.parameters for e in diagnosis.entries}
    asserted = sorted((effect(name) for name in diagnosis.effects), key=lambda e: -e.read_as)
    kept = unsure(diagnosis)
    for each in asserted:
        if each.correct is not None and each.name not in kept:
            recording = each.correct(recording, parameters.get(each.name, {}))
    return dataclasses.replace(recording, truth=None)
