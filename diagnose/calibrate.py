"""An instrument told from presses on something known: a rigid plate, or an object of known modulus.

On a rigid plate only the tool gives: force over travel is its stiffness, a loop of constant width its play,
one that grows with the rate a delay. On an object of known modulus the same effects as in a diagnosis are
fitted together, and kept where presses that were held out ask for them; what is left between known and found
modulus is the sensor's gain, or the tip's radius where the sensor is trusted, which no press on one material
can tell apart.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from diagnose.fit import Fit
from diagnose.forward import build_forward
from diagnose.freeair import free_air_of
from diagnose.instrument_offsets import find_instrument_offsets
from diagnose.intervals import covariance, parameter_intervals
from diagnose.judging import AttributionOptions, Candidate, Search
from diagnose.rigid import rigid_of
from diagnose.shape import site_stiffness_sd
from diagnose.touches import touches_of
from diagnose.whiten import NuisanceOptions
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
from reconstruct.contacts import Exploration
from reconstruct.filtering import low_pass
from reconstruct.placing import presses_on

TRUSTED = ("tip", "gain")
FITTED = (SPRING, GAIN, DELAY, PLAY)
"""Effects that a press on a known object shows, fitted together."""
LEAST_GAIN = 10.0
"""Log likelihood on held-out presses for which one of them is kept."""
MODULUS_SD = 0.02
"""Share by which law and mesh may miss a known modulus."""
_DELAYS_S = np.arange(-0.04, 0.0401, 0.001)
_BRISK, _TAKES_UP, _PRESSED = 0.2, 0.3, 0.1
_CORRELATED = 10.0
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
    strain = FINITE
    search = Search(
        forward, modulus_pa, nuisance=nuisance, options=AttributionOptions(),
        site_sd=site_stiffness_sd(touches, model, nuisance), finite_strain=strain,
    )  # fmt: skip
    base = [strain] if material.dent_law == "neo-hookean" else []
    # a bending that a rigid support shows is settled there
    tried = [e for e in FITTED if e.name not in offsets.names]
    kept, found = _kept(search, base, tried, progress)
    # what was dropped may still hide behind the modulus: the fit with all of it is as good
    whole = search.judge([*base, *tried]).found
    told = _told(recording, search, found.found, kept, offsets, modulus_pa, trust, seed)
    return _widened(told, search, whole, modulus_pa, trust)


def _kept(
    search: Search, base: list[Effect], tried: list[Effect], progress: Progress
) -> tuple[list[Effect], Candidate]:
    """Those without which held-out presses are predicted worse: the least of them goes until all are
    needed."""
    kept = list(tried)
    found = search.judge([*base, *kept])
    while kept:
        progress("instrument", 0.2 + 0.7 * (1 - len(kept) / len(tried)))
        gains = []
        for each in kept:
            without = search.judge([*base, *(e for e in kept if e is not each)])
            over = max(1.0, found.chi) * search.forward.touches.noise.variance_inflation
            gains.append(float((without.held - found.held).sum()) / over)
        least = int(np.argmin(gains))
        if gains[least] > LEAST_GAIN:
            break
        kept.pop(least)
        found = search.judge([*base, *kept])
    return kept, found


def _told(
    recording: Recording,
    search: Search,
    found: Fit,
    kept: list[Effect],
    offsets: Any,
    modulus_pa: float,
    trust: str,
    seed: int,
) -> Calibration:
    forward, rng = search.forward, np.random.default_rng(seed)
    names = {e.name for e in kept}
    keys = {e.name: e.report(found.of(e.name), forward, found.modulus) for e in kept}
    keys = {**offsets.parameters, **keys}
    between = {e.name: parameter_intervals(found, e.name, forward, search.dof, rng) for e in kept}
    between = {**offsets.intervals, **between}
    names |= set(offsets.names)
    spread = covariance(found, forward.touches.noise.variance_inflation, search.dof)
    scale_sd = float(np.hypot(np.sqrt(max(spread[0, 0], 0.0)), MODULUS_SD))
    scale = found.modulus / modulus_pa
    matrix = np.asarray(keys[GAIN.name]["matrix"]) if GAIN.name in names else np.eye(3)
    level = float(np.trace(matrix)) / 3
    matrix, scale = matrix / level, scale * level
    interval: dict[str, Any] = {}
    wide = np.exp(1.96 * scale_sd * np.array([-1, 1]))
    radius = None
    if trust == "gain":
        radius = recording.tip_radius_m * scale**2
        interval["tip_radius_m"] = (radius * wide**2).tolist()
    else:
        matrix = scale * matrix
        interval["common_gain"] = (scale * wide).tolist()
    stiffness = keys.get(SPRING.name, {}).get("stiffness_n_per_m")
    play = float(found.of(PLAY.name)[0]) if PLAY.name in names else None
    for name, key, label in (
        (SPRING.name, "stiffness_n_per_m", "stiffness_n_per_m"),
        (DELAY.name, "delay_s", "delay_s"),
        (PLAY.name, "width_m", "play_m"),
        (GAIN.name, "matrix", "cross_talk"),
    ):
        if key in between.get(name, {}):
            interval[label] = between[name][key]
    bias = offsets.parameters.get(BIAS.name, {}).get("bias_n")
    if bias is not None:
        interval["bias_n"] = offsets.intervals[BIAS.name]["bias_n"]
    mass = offsets.parameters.get(INERTIA.name, {}).get("mass_kg")
    about = {
        "on": f"an object of {modulus_pa:g} Pa",
        "recording": recording.name,
        "presses": len(forward.touches),
        "trusted": {"tip": "the tip's radius", "gain": "the sensor's common gain"}[trust],
        "misfit": float(np.sqrt(found.gram[:, 0, 0].sum() / search.dof)),
        "not_told": ["tip_radius_m" if trust == "tip" else "common gain", *_absent(names, bias)],
    }
    if mass is not None:
        about["mass_kg"] = mass
    return Calibration(
        tip_radius_m=radius,
        stiffness_n_per_m=stiffness,
        play_m=play,
        matrix=matrix,
        bias_n=None if bias is None else np.asarray(bias),
        delay_s=keys.get(DELAY.name, {}).get("delay_s"),
        interval=interval,
        about=about,
    )


def _widened(told: Calibration, search: Search, whole: Fit, modulus_pa: float, trust: str) -> Calibration:
    """With an interval of the common factor that holds what the fit of all effects allows as well."""
    spread = covariance(whole, search.forward.touches.noise.variance_inflation, search.dof)
    level = 1.0
    if GAIN.name in whole.names:
        level = float(np.trace(whole.of(GAIN.name).reshape(3, 3))) / 3
    scale, sd = (
        level * whole.modulus / modulus_pa,
        float(np.hypot(np.sqrt(max(spread[0, 0], 0.0)), MODULUS_SD)),
    )
    ends = scale * np.exp(1.96 * sd * np.array([-1, 1]))
    key = "common_gain"
    if trust == "gain":
        key, ends = "tip_radius_m", search.forward.tip_radius * ends**2
    low, high = told.interval[key]
    wider = [float(min(low, ends[0])), float(max(high, ends[1]))]
    return dataclasses.replace(told, interval={**told.interval, key: wider})


def _absent(names: set[str], bias: Any) -> list[str]:
    """What was not found: too small, or not asked for by these presses."""
    words = {
        SPRING.name: "tool's bending",
        GAIN.name: "cross-talk",
        DELAY.name: "delay",
        PLAY.name: "play",
    }
    return [w for n, w in words.items() if n not in names] + (["bias"] if bias is None else [])


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
        if inside.sum() < 20:
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
