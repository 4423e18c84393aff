"""An instrument told from presses on something known: a rigid plate, or an object of known modulus.

On a rigid plate only the tool gives: force over travel is its stiffness, a loop of constant width its play,
one that grows with the rate a delay. On an object of known modulus the same effects as in a diagnosis are
fitted together, none left out: presses that hardly tell a bending from a gain say so by both intervals,
while a bending left out would be taken for a gain. What is left between known and found
modulus is the sensor's gain, or the tip's radius where the sensor is trusted, which no press on one material
can tell apart.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from diagnose.forward.prediction import build_forward
from diagnose.forward.touches import touches_of
from diagnose.instrument.freeair import free_air_of
from diagnose.instrument.offsets import InstrumentOffsets, find_instrument_offsets
from diagnose.instrument.rigid import rigid_of
from diagnose.options import AttributionOptions
from diagnose.search.evidence import Search
from diagnose.search.fit import Fit, bounds_of
from diagnose.search.intervals import covariance
from diagnose.search.shape import site_stiffness_sd
from diagnose.search.whiten import NuisanceOptions
from mechanics.calibration import Calibration
from mechanics.effects.backlash import EFFECT as PLAY
from mechanics.effects.base import Effect
from mechanics.effects.finite_strain import EFFECT as FINITE
from mechanics.effects.force_bias import EFFECT as BIAS
from mechanics.effects.force_gain import EFFECT as GAIN
from mechanics.effects.time_delay import EFFECT as DELAY
from mechanics.effects.tool_compliance import EFFECT as SPRING
from mechanics.effects.tool_gravity_inertia import EFFECT as INERTIA
from mechanics.errors import ContactError, OptionError
from mechanics.model import Model
from mechanics.progress import Progress, silent
from mechanics.recording import Recording
from mechanics.samples import delayed
from reconstruct.placing import presses_on
from reconstruct.steps.s1_filter.filtering import low_pass
from reconstruct.steps.s3_contacts.contacts import Exploration

TRUSTED = ("tip", "gain")
FITTED = (SPRING, GAIN, DELAY, PLAY)
"""Effects that a press on a known object shows, fitted together."""
MODULUS_SD = 0.02
"""Share by which law and mesh may miss a known modulus."""
STIFFEST = 1e6
"""N/m: a tool that bends less is rigid here."""
_DRAWS = 400
_DELAYS_S = np.arange(-0.04, 0.0401, 0.001)
_BRISK, _TAKES_UP, _PRESSED = 0.2, 0.3, 0.1
_CORRELATED = 10.0
_LEAST_SAMPLES = 20
_UNLIKE = 0.1
"""Share by which the presses' own compliances may differ on a rigid plate."""
_PLAIN_Z = 4.0
_LAW_SD = (1e-3, 5e-6, 2e-4)
"""What filter and sampling leave besides noise: share of the tool's give, m of half the play, s of the delay
(twenty drawn plates; `palpate bench calibrate`)."""


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
    touches = touches_of(presses)
    free = free_air_of(recording, presses)
    progress("sites", 0.1)
    forward = build_forward(touches, model)
    rigid = rigid_of(recording, presses, model.support.normal)
    offsets = find_instrument_offsets(forward, free, rigid, set())
    nuisance = NuisanceOptions()
    search = Search(
        forward, modulus_pa, nuisance=nuisance, options=AttributionOptions(),
        site_sd=site_stiffness_sd(touches, model, nuisance), finite_strain=FINITE,
    )  # fmt: skip
    base = [FINITE] if material.dent_law == "neo-hookean" else []
    # a bending that a rigid support shows is settled there
    fitted = [e for e in FITTED if e.name not in offsets.names]
    progress("instrument", 0.3)
    return _told(recording, search, search.judge([*base, *fitted]).found, offsets, modulus_pa, trust, seed)


def _told(
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
    spread = covariance(found, forward.touches.noise.variance_inflation, search.dof)
    spread = spread + np.diag(_systematic(found) ** 2)
    drawn = rng.multivariate_normal(found.values, spread, _DRAWS, check_valid="ignore")
    drawn = np.clip(drawn, *bounds_of(found.effects)[:2])
    rigid = _rigid_give(offsets)
    known = modulus_pa * np.exp(MODULUS_SD * rng.standard_normal(_DRAWS))
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
            *_not_told(interval),
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
    """(k,) standard deviations of the fit's values that no noise tells, as the effects state them."""
    parts = [np.zeros(1)]
    for effect in found.effects:
        none = np.zeros(len(effect.parameters))
        share = np.asarray(effect.systematic_share or none) * found.of(effect.name)
        parts.append(np.hypot(effect.systematic or none, share))
    return np.concatenate(parts)


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


def _not_told(interval: dict[str, Any]) -> list[str]:
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


def calibrate_on_plate(recording: Recording, exploration: Exploration) -> Calibration:
    """exploration: its contacts with a rigid plate. Raises ContactError where no press goes in and out."""
    presses = exploration.presses
    normal = presses.contact_normal.mean(axis=0)
    normal /= np.linalg.norm(normal)
    plate = _plate_normal(presses.centre, normal)
    net = (presses.force - presses.free_air).copy()
    rate = presses.sample_rate_hz
    u, push, way, press = [], [], [], []
    shifted = {tau: delayed(presses.parts, presses.t, net, -tau) for tau in _DELAYS_S}
    for i, part in enumerate(presses.parts):
        inside = (presses.t[part] >= presses.onset_s[i]) & (presses.t[part] <= presses.end_s[i])
        if inside.sum() < _LEAST_SAMPLES:
            continue
        deep = -low_pass(presses.position[part], rate, 25.0) @ plate
        moving = np.gradient(deep, 1 / rate)
        brisk = np.abs(moving) > _BRISK * np.abs(moving[inside]).max()
        turned = inside & (np.arange(len(deep)) > np.argmax(np.where(inside, deep, -np.inf)))
        # right after it turned round the tool takes up its play, and the force stands still
        taking_up = turned & (deep.max() - deep < _TAKES_UP * np.ptp(deep[inside]))
        pressed = net[part] @ plate > _PRESSED * (net[part] @ plate).max()
        rows = np.flatnonzero(inside & brisk & pressed & ~taking_up) + part.start
        u.append(deep[rows - part.start])
        way.append(np.sign(moving[rows - part.start]))
        push.append(rows)
        press.append(np.full(len(rows), i))
    if len(u) < 3:
        raise ContactError(f"{len(u)} presses go in and out of the plate's contact; at least 3 are needed")
    rows, each = np.concatenate(push), np.concatenate(press)
    travel, sense = np.concatenate(u), np.concatenate(way)
    offset = (each[:, None] == np.unique(each)).astype(float)

    def fitted(tau: float) -> tuple[float, np.ndarray, np.ndarray]:
        columns = np.column_stack([shifted[tau][rows] @ plate, sense, offset])
        found, *_ = np.linalg.lstsq(columns, travel, rcond=None)
        left = travel - columns @ found
        spread = np.linalg.pinv(columns.T @ columns) * (left @ left) / max(len(left) - columns.shape[1], 1)
        return float(left @ left), found, np.sqrt(np.maximum(np.diag(spread)[:2] * _CORRELATED, 0.0))

    costs = np.array([fitted(tau)[0] for tau in _DELAYS_S])
    best = int(np.argmin(costs))
    delay, delay_sd = _refined(costs, best, len(travel))
    _, found, sd = fitted(_DELAYS_S[best])
    give, half = float(found[0]), float(found[1])
    sd = np.hypot(sd, [_LAW_SD[0] * abs(give), _LAW_SD[1]])
    delay_sd = float(np.hypot(delay_sd, _LAW_SD[2]))
    stiff = give > _PLAIN_Z * sd[0]
    unlike = _unlike(shifted[_DELAYS_S[best]][rows] @ plate, travel, sense, each)
    if stiff and unlike > _UNLIKE:
        raise ContactError(
            f"what yields differs from press to press by {100 * unlike:.0f} % of {1e3 * give:.3g} mm/N, and "
            f"a tool on a rigid plate yields alike at every place (to {100 * _UNLIKE:.0f} %): this is no "
            "rigid plate, or it moves; press a clamped plate of metal or glass, or give --modulus of a known "
            "object"
        )
    interval: dict[str, Any] = {"delay_s": [delay - 1.96 * delay_sd, delay + 1.96 * delay_sd]}
    if stiff:
        interval["stiffness_n_per_m"] = [1 / (give + 1.96 * sd[0]), 1 / max(give - 1.96 * sd[0], 1e-9)]
    interval["play_m"] = [2 * (half - 1.96 * sd[1]), 2 * (half + 1.96 * sd[1])]
    read = net[rows]
    lean = read.sum(axis=0) / max(float((read @ plate).sum()), 1e-300) - plate
    free = presses.within("free", recording.t)
    bias = recording.force_on_tool[free].mean(axis=0) if free.sum() > rate else None
    absent = ["tip_radius_m", "gains", "cross-talk of sideways forces"]
    return Calibration(
        stiffness_n_per_m=1 / give if stiff else None,
        play_m=2 * half if abs(half) > _PLAIN_Z * sd[1] else None,
        bias_n=bias,
        delay_s=delay if abs(delay) > _PLAIN_Z * delay_sd else None,
        interval=interval,
        about={
            "on": "a rigid plate",
            "recording": recording.name,
            "presses": len(u),
            "normal": plate.tolist(),
            "sideways_reading_per_newton": lean.tolist(),
            "not_told": absent + ([] if stiff else ["tool's bending: stiffer than can be told"]),
        },
    )


def _unlike(push: np.ndarray, travel: np.ndarray, sense: np.ndarray, each: np.ndarray) -> float:
    """Standard deviation of the presses' own compliances, less what their errors make, over their mean (the
    random-effects estimate of DerSimonian and Laird, 1986).

    push (n,) N, travel (n,) m, sense (n,) in or out, each (n,) the press of every sample.
    """
    found = []
    for k in np.unique(each):
        own = each == k
        if own.sum() < _LEAST_SAMPLES:
            continue
        columns = np.column_stack([push[own], sense[own], np.ones(own.sum())])
        slope, *_ = np.linalg.lstsq(columns, travel[own], rcond=None)
        left = travel[own] - columns @ slope
        spread = np.linalg.pinv(columns.T @ columns)[0, 0] * (left @ left) / (own.sum() - 3)
        found.append((float(slope[0]), float(spread) * _CORRELATED))
    if len(found) < 3:
        return 0.0
    gives, variances = np.array(found).T
    weights = 1 / np.maximum(variances, 1e-300)
    mean = float(gives @ weights / weights.sum())
    excess = float(weights @ (gives - mean) ** 2) - (len(gives) - 1)
    between = max(excess, 0.0) / max(weights.sum() - (weights**2).sum() / weights.sum(), 1e-300)
    return float(np.sqrt(between) / max(abs(mean), 1e-300))


def _plate_normal(centre: np.ndarray, usual: np.ndarray) -> np.ndarray:
    """The normal of the plane through the touches, which no sensor bends; the forces' where they lie on a
    line."""
    offset = centre - centre.mean(axis=0)
    _, size, axes = np.linalg.svd(offset, full_matrices=False)
    if len(centre) < 4 or size[1] < 5 * size[2] or size[1] < 5e-3:
        return usual
    return axes[2] * np.sign(axes[2] @ usual)


def _refined(costs: np.ndarray, best: int, count: int) -> tuple[float, float]:
    """The least of a parabola through three delays, s, and its standard error."""
    step = float(_DELAYS_S[1] - _DELAYS_S[0])
    if not 0 < best < len(costs) - 1:
        return float(_DELAYS_S[best]), step
    left, here, right = costs[best - 1 : best + 2]
    bend = left - 2 * here + right
    delay = float(_DELAYS_S[best]) + 0.5 * step * (left - right) / max(bend, 1e-300)
    variance = _CORRELATED * here / max(count, 1) * 2 * step**2 / max(bend, 1e-300)
    return delay, float(np.sqrt(variance))
