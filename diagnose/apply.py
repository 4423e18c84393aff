"""What a diagnosis changes: the model (object, contact, boundary effects) or the recording (instrument
effects)."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from diagnose.freeair import matrices
from diagnose.library import effect
from diagnose.result import Diagnosis
from mechanics.material import Ball, Gradient, Skin
from mechanics.model import Model
from mechanics.recording import Recording

NOT_RENDERED = ("surface_shape", "surface_offset")
"""They say that the model's surface is wrong, not what it should be."""
FOUND_INCLUSION = "diagnosed"
REPLAYS = 2
"""Of the modulus's refit: a force goes with the modulus but for friction and adhesion."""


def improved(model: Model, diagnosis: Diagnosis) -> tuple[Model, list[str]]:
    """(model with the asserted effects, their names). Instrument effects are left out: they must not be
    rendered.

    The modulus, and the dent law that is rendered, are those of the diagnosis's own fit; see
    `with_replayed_modulus`.
    """
    parameters = {e.name: dict(e.parameters) for e in diagnosis.entries}
    asserted = {name: parameters.get(name, {}) for name in diagnosis.effects}
    provenance = {**model.provenance, "diagnosed_effects": list(diagnosis.effects)}
    if diagnosis.attribution is not None:
        fitted = diagnosis.attribution.final.found
        deep = "finite_strain" in (*fitted.names, *diagnosis.effects, *model.effects)
        model = model.with_material(dent_law="neo-hookean" if deep else "linear")
        if "adhesion" in asserted and "adhesion" in fitted.names:
            asserted["adhesion"].setdefault("inside", float(fitted.of("adhesion")[2]))
    better = with_effects(model.with_modulus(diagnosis.young_modulus_pa), asserted)
    better = better.replaced(provenance=provenance)
    return better, [name for name in asserted if rendered(name)]


def with_replayed_modulus(model: Model, recording: Recording) -> Model:
    """The model with the Young's modulus at which the renderer's own replay meets the recording best.

    A fit moves first touches and sites' stiffnesses beside the modulus, which a renderer cannot; what they
    leave to the modulus is made good here, by the median over presses: one drag that the model misses must
    not decide. recording: read right (`corrected`). Where the replay gives no force the model stays.
    """
    from render.fem import FemRenderer
    from render.replay import replay_recording

    counted = model.presses.touching(recording.t)
    begins = np.flatnonzero(np.diff(np.concatenate([[False], counted])) & counted)
    if not len(begins):
        return model
    measured = recording.force_on_tool
    renderer, modulus = FemRenderer(model), model.material.young_modulus_pa
    for _ in range(REPLAYS):
        forces = np.where(counted[:, None], replay_recording(renderer, recording), 0.0)
        meets = np.add.reduceat((forces * measured).sum(axis=1), begins)
        power = np.add.reduceat((forces**2).sum(axis=1), begins)
        felt = power > 0
        if not felt.any():
            return model
        modulus *= float(np.median(meets[felt] / power[felt]))
        renderer = renderer.with_modulus(modulus)
    return model.with_modulus(modulus)


def rendered(name: str) -> bool:
    """Whether an effect belongs into a model: those of the instrument do not. Raises OptionError for an
    unknown one."""
    return effect(name).domain != "instrument" and name not in NOT_RENDERED


def with_effects(model: Model, effects: Mapping[str, Mapping[str, Any]]) -> Model:
    """The model with these effects, by the contract's keys (SI, device frame), over those that it has.

    All go to [effects.NAME]; what of one is material goes into the material, where it counts: an inclusion
    beside those that are known, a gradient times the one that is there, the rest in place of what is there.
    Effects of the instrument are left out.
    """
    kept = {name: dict(keys) for name, keys in effects.items() if rendered(name)}
    for name, keys in kept.items():
        material = model.material
        if name == "inclusion":
            known = material.inclusions
            found = {f"{FOUND_INCLUSION}-{len(known) + 1}": Ball(**keys)}
            model = model.with_material(inclusions={**known, **found})
        elif name == "modulus_gradient":
            there = material.gradient or Gradient(1.0, 1.0)
            base, top = float(keys["ratio_base"]), float(keys["ratio_top"])
            both = Gradient(base * there.ratio_base, top * there.ratio_top)
            model = model.with_material(gradient=both)
        elif name == "skin_layer":
            model = model.with_material(skin=Skin(**keys))
        elif name == "poisson_ratio":
            model = model.with_material(poisson_ratio=keys["poisson_ratio"])
        elif name == "finite_strain":
            model = model.with_material(dent_law="neo-hookean")
    return model.replaced(effects={**{k: dict(v) for k, v in model.effects.items()}, **kept}, path=None)


def corrected(recording: Recording, diagnosis: Diagnosis) -> Recording:
    """The recording with asserted instrument effects taken off: bias, drift, weight and inertia, gain, delay.

    Tool compliance moves the tip by force / stiffness; a play is not undone (the tip's side of it is not
    known in free air). Times keep their samples; a delayed force is read earlier, its ends held.
    """
    t, force, position = recording.t, recording.force_on_tool.copy(), recording.position.copy()
    parameters = {e.name: e.parameters for e in diagnosis.entries}
    for name in diagnosis.effects:
        keys = parameters.get(name, {})
        if name == "force_bias":
            force -= np.array(keys["bias_n"])
        elif name == "force_drift":
            force -= t[:, None] * np.array(keys["rate_n_per_s"])
        elif name == "tool_gravity_inertia":
            force += keys["mass_kg"] * _smooth_acceleration(recording)
            if "weight_n" in keys and recording.quaternion is not None:
                turned = matrices(recording.quaternion)
                weight = np.array(keys["weight_n"])
                force -= weight - turned @ (turned[0].T @ weight)
        elif name == "force_gain":
            force = force @ np.linalg.inv(np.array(keys["matrix"])).T
        elif name == "time_delay":
            force = np.stack([np.interp(t + keys["delay_s"], t, f) for f in force.T], axis=1)
        elif name == "tool_compliance":
            position += force / keys["stiffness_n_per_m"]
    return dataclasses.replace(recording, force_on_tool=force, position=position, truth=None)


def _smooth_acceleration(recording: Recording, width_s: float = 0.05) -> np.ndarray:
    from scipy.signal import savgol_filter

    width = max(5, round(width_s * recording.sample_rate_hz) | 1)
    return savgol_filter(
        recording.position, width, 2, deriv=2, delta=1 / recording.sample_rate_hz, axis=0, mode="nearest"
    )
