"""An instrument calibrated by presses on an object of known modulus.

The same effects as in a diagnosis are fitted together, none left out: presses that hardly separate a bending
from a gain say so by both intervals, while a bending left out would be taken for a gain. What is left between
known and found modulus is the sensor's gain, or the tip's radius where the sensor is trusted, which no press
on one material can tell apart.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from palpate.diagnosis.forward.prediction import build_forward
from palpate.diagnosis.instrument.free_air_offsets import InstrumentOffsets
from palpate.diagnosis.instrument.instrument_effects import taken_off
from palpate.diagnosis.instrument.readings import readings_of
from palpate.diagnosis.options import AttributionOptions, NuisanceOptions
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.fit import Fit, bounds_of, covariance
from palpate.diagnosis.search.site_stiffness import site_stiffness_sd
from palpate.mechanics.effects.backlash import EFFECT as PLAY
from palpate.mechanics.effects.base import Effect
from palpate.mechanics.effects.finite_strain import EFFECT as FINITE
from palpate.mechanics.effects.force_bias import EFFECT as BIAS
from palpate.mechanics.effects.force_gain import EFFECT as GAIN
from palpate.mechanics.effects.time_delay import EFFECT as DELAY
from palpate.mechanics.effects.tool_compliance import EFFECT as SPRING
from palpate.mechanics.effects.tool_gravity_inertia import EFFECT as INERTIA
from palpate.mechanics.errors import OptionError
from palpate.mechanics.law_errors import Level
from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.recording.calibration import Calibration
from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.presses_on_model import presses_on

TRUSTED = ("tip", "gain")
FITTED = (SPRING, GAIN, DELAY, PLAY)
"""Effects that a press on a known object shows, fitted together."""
STIFFEST = 1e6
"""N/m: a tool that bends less is rigid here."""
_DRAWS = 400


def calibrate_on_object(
    recording: Recording,
    model: Model,
    modulus_pa: float,
    *,
    trust: str = "tip",
    seed: int = 0,
    progress: Progress = silent,
) -> Calibration:
    """model: of the object, with the recording's presses; modulus_pa: its own, known. trust: "tip" gives a
    common factor to the sensor, "gain" to the tip's radius. Raises DiagnosisError where presses are too
    few."""
    if trust not in TRUSTED:
        raise OptionError(f"trust is '{trust}'; allowed are {', '.join(TRUSTED)}")
    material = dataclasses.replace(model.material, young_modulus_pa=modulus_pa)
    model = model.replaced(material=material)
    presses = presses_on(recording, model)
    readings = readings_of(recording, presses, model.support.normal, fitted=False)
    progress("sites", 0.1)
    forward = build_forward(readings.touches, model)
    offsets = taken_off(readings, forward, ())
    nuisance = NuisanceOptions()
    search = Search(
        forward, modulus_pa, nuisance=nuisance, options=AttributionOptions(),
        site_sd=site_stiffness_sd(forward, nuisance), finite_strain=FINITE,
    )  # fmt: skip
    base = [FINITE] if material.dent_law == "neo-hookean" else []
    # a bending that a rigid support shows is settled there
    fitted = [e for e in FITTED if e.name not in offsets.names]
    progress("instrument", 0.3)
    return _calibration(
        recording, search, search.judge([*base, *fitted]).found, offsets, modulus_pa, trust, seed
    )


def _calibration(
    recording: Recording,
    search: Search,
    found: Fit,
    offsets: InstrumentOffsets,
    modulus_pa: float,
    trust: str,
    seed: int,
) -> Calibration:
    """What the fit says and, drawn from its covariance, within which limits."""
    forward, rng = search.forward, np.random.default_rng(seed)
    spread = covariance(found, search.dof)
    spread = spread + np.diag(_systematic(found) ** 2)
    drawn = rng.multivariate_normal(found.values, spread, _DRAWS, check_valid="ignore")
    drawn = np.clip(drawn, *bounds_of(found.effects, search.whitener.shared_sd)[:2])
    rigid = _rigid_give(offsets)
    known = modulus_pa * np.exp(Level.calibration.value * rng.standard_normal(_DRAWS))
    give = rigid[0] + rigid[1] * rng.standard_normal(_DRAWS)
    normal = forward.model.support.normal
    here = instrument_of(found, found.values, modulus_pa, rigid[0], normal, trust)
    each = [instrument_of(found, *numbers, normal, trust) for numbers in zip(drawn, known, give, strict=True)]
    interval: dict[str, Any] = {
        key: np.quantile([k[key] for k in each], [0.025, 0.975], axis=0) for key in here
    }
    radius = recording.tip_radius_m * here["radius"]
    interval["tip_radius_m"] = recording.tip_radius_m * interval.pop("radius")
    # a spring's give may be none, its stiffness not
    interval["stiffness_n_per_m"] = 1 / np.maximum(interval.pop("give")[::-1], 1 / STIFFEST)
    trusts_tip = trust == "tip"
    interval.pop("tip_radius_m" if trusts_tip else "common_gain")
    bias = offsets.parameters.get(BIAS.name, {}).get("bias_n")
    if bias is not None:
        interval["bias_n"] = offsets.intervals[BIAS.name]["bias_n"]
    about = {
        "on": f"an object of {modulus_pa:g} Pa",
        "recording": recording.name,
        "presses": len(forward.touches),
        "trusted": "the tip's radius" if trusts_tip else "the sensor's common gain",
        "misfit": float(np.sqrt(found.gram[:, 0, 0].sum() / search.dof)),
        "not_told": [
            "tip_radius_m" if trusts_tip else "common gain",
            *_not_calibration(interval),
            *([] if bias is not None else ["bias"]),
        ],
    }
    mass = offsets.parameters.get(INERTIA.name, {}).get("mass_kg")
    if mass is not None:
        about["mass_kg"] = mass
    return Calibration(
        tip_radius_m=None if trusts_tip else radius,
        stiffness_n_per_m=1 / max(here["give"], 1 / STIFFEST),
        play_m=here["play_m"],
        matrix=here["matrix"],
        bias_n=None if bias is None else np.asarray(bias),
        delay_s=here["delay_s"],
        interval={key: np.asarray(ends).tolist() for key, ends in interval.items()},
        about=about,
    )


def _systematic(found: Fit) -> np.ndarray:
    """(k,) standard deviations of the fit's values that noise does not hold, as the effects state them."""
    parts = [np.zeros(1)]
    for effect in found.effects:
        none = np.zeros(len(effect.parameters))
        share = np.asarray(effect.hints.systematic_share or none) * found.of(effect.name)
        parts.append(np.hypot(effect.hints.systematic or none, share))
    return np.concatenate([*parts, np.zeros_like(found.shared)])


def _rigid_give(offsets: InstrumentOffsets) -> tuple[float, float]:
    """(m/N of the force as read, standard error) of a tool that the support shows to bend, else 0."""
    if SPRING.name not in offsets.names:
        return 0.0, 0.0
    stiffness = offsets.parameters[SPRING.name]["stiffness_n_per_m"]
    low, high = offsets.intervals[SPRING.name]["stiffness_n_per_m"]
    return 1 / stiffness, (1 / low - 1 / high) / (2 * 1.96)


def instrument_of(
    found: Fit, values: np.ndarray, modulus_pa: float, rigid: float, normal: np.ndarray, trust: str
) -> dict[str, Any]:
    """One draw as numbers of the instrument: matrix (3, 3), common_gain, radius over the stated one, give
    (m/N of true force), play_m, delay_s. rigid: m/N of read force, on a support of that normal (3,).

    A fit's spring gives by the fit's force, which is the true one times what the modulus took up.
    """

    def of(effect: Effect) -> np.ndarray:
        return values[found.place_of(effect.name)]

    matrix = of(GAIN).reshape(3, 3)
    level, taken = float(np.trace(matrix)) / 3, float(np.exp(values[0])) / modulus_pa
    if trust == "tip":
        matrix, fitted_over_true, radius = taken * matrix, taken, 1.0
    else:
        matrix, fitted_over_true, radius = matrix / level, 1 / level, (taken * level) ** 2
    give = rigid * float(normal @ matrix @ normal)
    if SPRING.name in found.names:
        give = float(of(SPRING)[0]) * fitted_over_true
    return {
        "matrix": matrix,
        "common_gain": float(np.trace(matrix)) / 3,
        "radius": radius,
        "give": give,
        "play_m": float(of(PLAY)[0]),
        "delay_s": float(of(DELAY)[0]),
    }


def _not_calibration(interval: dict[str, Any]) -> list[str]:
    """What may as well not be there, by its interval; it is in the file all the same, as the rest was found
    beside it."""
    found = []
    if interval["stiffness_n_per_m"][1] >= STIFFEST:
        found.append("tool's bending")
    low, high = interval["matrix"]
    apart = ~np.eye(3, dtype=bool)
    if ((low < 0) & (high > 0))[apart].all():
        found.append("cross-talk")
    words = {"delay_s": "delay", "play_m": "play"}
    return found + [w for key, w in words.items() if interval[key][0] <= 0 <= interval[key][1]]
