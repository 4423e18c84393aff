"""What a diagnosis changes: the model (object, contact, boundary effects) or the recording (instrument
effects)."""

from __future__ import annotations

import dataclasses

import numpy as np

from diagnose.effects.inclusion import inside
from diagnose.freeair import matrices
from diagnose.library import effect
from diagnose.result import Diagnosis
from mechanics.model import Model
from mechanics.recording import Recording

BY_LAW = (
    "finite_strain",
    "strain_stiffening",
    "viscoelasticity",
    "mullins_softening",
    "tip_radius",
    "friction_slip",
    "adhesion",
)
"""Effects that the renderer runs from their keys in [effects.NAME]."""
MODULUS_LIMITS = (0.05, 50.0)


def improved(model: Model, diagnosis: Diagnosis) -> tuple[Model, list[str]]:
    """(model with the asserted effects, their names). Instrument effects are left out: they must not be
    rendered.

    Laws of material and contact go to [effects.NAME]; inclusions, gradients and skins into the elements'
    moduli; Poisson's ratio into the material; a loose or springy base to [effects.NAME], where the
    compliance reads it.
    """
    effects = {k: dict(v) for k, v in model.effects.items()}
    ratio = model.modulus_ratio.copy()
    nu, mesh = model.poisson_ratio, model.mesh
    kept = []
    parameters = {e.name: e.parameters for e in diagnosis.entries}
    centroid = mesh.points[mesh.tetrahedra[:, :4]].mean(axis=1)
    height = (centroid - model.support_point) @ model.support_normal
    for name in diagnosis.effects:
        keys = parameters.get(name, {})
        if effect(name).domain == "instrument" or name in ("surface_shape", "surface_offset"):
            continue
        effects[name] = dict(keys)
        kept.append(name)
        if name == "inclusion":
            blur = float(np.cbrt(np.median(mesh.volumes)))
            share = inside(centroid, np.array(keys["centre_m"]), keys["radius_m"], blur)
            ratio = ratio * keys["modulus_ratio"] ** share
        elif name == "modulus_gradient":
            top = height.max() * 1.02
            ratio = ratio * (keys["ratio_base"] + (keys["ratio_top"] - keys["ratio_base"]) * height / top)
        elif name == "skin_layer":
            from scipy.spatial import cKDTree

            depth = cKDTree(mesh.points[mesh.touchable]).query(centroid)[0]
            ratio = np.where(depth < keys["thickness_m"], ratio * keys["modulus_ratio"], ratio)
        elif name == "poisson_ratio":
            nu = float(keys["poisson_ratio"])
    ratio = np.clip(ratio, *MODULUS_LIMITS)
    provenance = {**model.provenance, "diagnosed_effects": list(diagnosis.effects)}
    better = dataclasses.replace(
        model,
        young_modulus_pa=diagnosis.young_modulus_pa,
        young_modulus_ci95_pa=(float("nan"), float("nan")),
        poisson_ratio=nu,
        modulus_ratio=ratio,
        effects=effects,
        provenance=provenance,
        path=None,
    )
    return better, kept


def corrected(recording: Recording, diagnosis: Diagnosis) -> Recording:
    """The recording with asserted instrument effects taken off: bias, drift, weight and inertia, gain, delay.

    Tool compliance moves the tip by force / stiffness; a play is not undone (the tip's side of it is not
    known
    in free air). Times keep their samples; a delayed force is read earlier, its ends held.
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
