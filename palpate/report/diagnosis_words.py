"""A diagnosis in words that need no knowledge of the program: the three answers, quantities with units."""

from __future__ import annotations

from typing import Any

import numpy as np

from diagnose.verdict.result import Diagnosis
from mechanics.effects.registry import effect
from mechanics.quantities import read_unit, split_key

AXIS_WORDS = {
    "depth": "how deep the press is",
    "rate": "how fast the press is",
    "phase": "whether the tip goes in, rests or comes out",
    "direction": "whether the tip is dragged sideways",
    "space": "the place on the object",
    "order": "when in the session it was touched",
    "repeat": "whether a place is touched for the first time or again",
    "free_air": "what the sensor reads in free air, touching nothing",
}

ERROR_WORDS = {
    "sensor": "noise of the force sensor",
    "repeatability": "touching one place again does not give the same force",
    "shape": "the object's shape is not known where nobody touched",
}

WORDS = {
    "depth": "how deep the press is",
    "rate": "how fast the press is",
    "phase": "whether the tip goes in, rests or comes out",
    "direction": "whether the tip is dragged sideways",
    "space": "the place on the object",
    "order": "when in the session it was touched",
    "repeat": "whether a place is touched for the first time or again",
    "free_air": "what the sensor reads in free air, touching nothing",
}

ERROR_WORDS = {
    "sensor": "noise of the force sensor",
    "repeatability": "touching one place again does not give the same force",
    "shape": "the object's shape is not known where nobody touched",
}

UNITS = (
    ("_m2_per_s", 1e6, "mm²/s"),
    ("_j_per_m2", 1.0, "J/m²"),
    ("_n_per_m", 1e-3, "N/mm"),
    ("_n_per_s", 1e3, "mN/s"),
    ("_pa_per_m", 1e-6, "kPa/mm"),
    ("_kg", 1e3, "g"),
    ("_rad", 180 / np.pi, "degrees"),
    ("_m", 1e3, "mm"),
    ("_s", 1e3, "ms"),
    ("_n", 1e3, "mN"),
)
WORDS = {
    "mu": "friction coefficient",
    "g": "extra force right after a fast press, shares of the lasting force",
    "tau_s": "that extra force fades within",
    "share": "extra force right after a fast press, share of the lasting force",
    "exponent": "it fades by this power of time",
    "diffusivity_m2_per_s": "fluid drains at",
    "work_j_per_m2": "work to separate the surfaces",
    "healed": "share of it that pulls on first touch",
    "c20_over_c10": "stiffening (c20 over c10; below 0 it softens)",
    "r": "softening on repeats (r; smaller is more)",
    "m_rel": "width of the softening (m, of the greatest load)",
    "matrix": "reading per true force, 3 x 3",
    "tip_radius_m": "radius of the tip",
    "poisson_ratio": "Poisson's ratio",
    "centre_m": "middle at",
    "radius_m": "radius",
    "modulus_ratio": "stiffness relative to the rest, times",
    "thickness_m": "thickness",
    "ratio_base": "stiffness at the base, times the mean",
    "ratio_top": "stiffness at the top, times the mean",
    "k_normal_pa_per_m": "support's stiffness, pressed",
    "k_tangential_pa_per_m": "support's stiffness, sideways",
    "bonded_fraction": "share of the base that holds",
    "direction": "the loose part lies towards",
    "pull_off_n": "greatest pull",
    "range_m": "felt up to this distance",
    "inside": "share of it that holds within the contact too",
    "stiffness_n_per_m": "the tool's stiffness",
    "bias_n": "reading in free air, x y z",
    "rate_n_per_s": "zero drifts by, x y z",
    "mass_kg": "mass beyond the sensor",
    "delay_s": "force reads late by",
    "width_m": "width of the play",
    "shift_m": "shift, x y z",
    "rotation_rad": "turn, x y z",
}


def meaning(name: str) -> str:
    """What an effect is, for a person who has never heard of it."""
    return effect(name).plain_words or effect(name).words


LITTLE = 0.1
"""A share of the difference below which it is not said to depend on something."""


def spoken(names: tuple[str, ...] | list[str], last: str = "and") -> str:
    """Effects' names as a list in a sentence."""
    words = [n.replace("_", " ") for n in names]
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def force_words(newtons: float) -> str:
    """A force in millinewtons."""
    return f"{newtons * 1e3:.0f} mN"


def percent(share: float) -> str:
    """A share as a percentage, which no line breaks."""
    return f"{100 * share:.0f}\u00a0%"


def share_words(value: float | None) -> str:
    """A share of the gap that is closed."""
    if value is None:
        return "-"
    return percent(value) if value >= 0 else "none (worse)"


def verdict(result: Diagnosis) -> str:
    """The answer in one sentence."""
    effects, rivals = spoken(result.effects), spoken(result.candidates, "or")
    return {
        "none": "The simulation agrees with the measured forces: no physical effect is missing that these "
        "touches could show.",
        "effect": f"The simulation leaves out {effects}. That explains where it differs from the measured "
        "force.",
        "ambiguous": f"The simulation leaves something out: most likely {effects}, but these touches cannot "
        f"rule out {rivals}.",
        "unknown": "The simulation differs from the measured force, and nothing that this program knows "
        "explains it" + (f"; {rivals} is suspected." if rivals else "."),
        "effect+unknown": f"The simulation leaves out {effects}, which explains part of the difference; "
        "something that this program does not know remains.",
    }[result.kind]


def answers(result: Diagnosis, force_rms_n: float) -> list[tuple[str, str, str]]:
    """(question, answer, sentences) of where, which and how far. force_rms_n: typical force of a touch."""
    return [_where(result), _which(result), _how_far(result, force_rms_n)]


def _where(result: Diagnosis) -> tuple[str, str, str]:
    axis = result.where.leading
    x, y, z, rms = result.where.worst[0]
    largest = f"({x * 1e3:.0f}, {y * 1e3:.0f}, {z * 1e3:.0f}) mm"
    question = "Where do they differ?"
    if result.kind == "none":
        text = (
            f"No place, depth or speed stands out beyond what noise, first touch and shape may do. The "
            f"largest difference is {force_words(rms)}, at {largest} (marked)."
        )
        return question, "Nowhere in particular", text
    there = f"largest at {largest} (marked): {force_words(rms)} there."
    if axis.share < LITTLE:
        text = f"What it follows most is {AXIS_WORDS[axis.axis]}, and that is {percent(axis.share)} of it. "
        text += f"It is {there}"
        return question, "It follows no single thing", text
    chance = "" if axis.p < 0.05 else " This may be chance."
    text = (
        f"{percent(axis.share)} of the difference between measured and simulated force follows it.{chance} "
        "The "
        f"difference is {there}"
    )
    return question, f"It depends on {AXIS_WORDS[axis.axis]}", text


def _which(result: Diagnosis) -> tuple[str, str, str]:
    question = "Which effect is missing?"
    if result.kind == "none":
        return question, "None", "What is left is no larger than sensor noise and our own errors explain."
    if not result.effects:
        text = "There is a difference, but none of the effects that were tried explains it. " + _suspects(
            result
        )
        return question, "Unknown", text.strip()
    parameters = {e.name: e.parameters for e in result.entries}
    parts = []
    for name in result.effects:
        keys = parameters.get(name, {})
        in_words = effect(name).keys_in_words
        said = in_words(keys) if in_words is not None and keys else short(keys)
        parts.append(meaning(name) + (f" ({said})" if said else ""))
    text = "; ".join(parts)
    text = text[0].upper() + text[1:] + ". " + _suspects(result)
    if "unknown" in result.kind:
        text += " Something that this program does not know remains."
    answer = spoken(result.effects)
    if result.candidates:
        answer += f" (or {spoken(result.candidates, 'or')})"
    return question, answer[0].upper() + answer[1:], text.strip()


def _suspects(result: Diagnosis) -> str:
    if not result.candidates:
        return ""
    also = "; ".join(f"{n.replace('_', ' ')}: {meaning(n)}" for n in result.candidates)
    return f"Not ruled out by these touches - {also}."


def _how_far(result: Diagnosis, force_rms_n: float) -> tuple[str, str, str]:
    question = "How far does it shrink?"
    before, noise = force_words(result.gap_before_n), force_words(result.noise_n)
    size = f"{percent(result.gap_before_n / force_rms_n)} of the force of a typical touch"
    typical = "Typical difference (root mean square) at places that were left out of the fit"
    if result.effects and result.gap_closed is not None and result.gap_closed_ci95 is not None:
        low, high = result.gap_closed_ci95
        after = force_words(result.gap_after_n)
        if result.gap_after_n >= 0.98 * result.gap_before_n:
            return question, f"{before}, and not less", (
                f"{typical}: {before} ({size}). What was found does not lower it there. The sensor's own "
                f"noise is {noise}."
            )  # fmt: skip
        text = (
            f"{typical}: {before} before ({size}), {after} with what was found. The sensor's own noise is "
            f"{noise}, so {percent(result.gap_closed)} of what lies above it is gone (95 % sure: "
            f"{percent(low)} to "
            f"{percent(high)})."
        )
        return question, f"From {before} to {after}", text
    text = f"{typical}: {before} ({size}). The sensor's own noise is {noise}."
    if result.kind == "none":
        return question, "There is nothing to shrink", text
    return question, f"It stays at {before}", text + " With no effect found, nothing of it is gone."


MOST_NUMBERS = 12
"""Of a list that are written out; of longer ones the least and the greatest."""


def plain_key(key: str) -> tuple[str, float, str]:
    """(words, factor from SI, unit) of a parameter's key, in units that a hand knows."""
    name, si = split_key(key)
    unit, factor = read_unit(si)
    return WORDS.get(key, name.replace("_", " ")), factor, unit


def number(value: Any, factor: float = 1.0) -> str:
    """A parameter's value, or a list of values, to three digits."""
    if isinstance(value, list) and len(value) == 1:
        return number(value[0], factor)
    if isinstance(value, list) and len(value) > MOST_NUMBERS:
        least, most = (number(float(f(value)), factor) for f in (np.min, np.max))
        return f"{least} to {most} ({len(value)} values)"
    if isinstance(value, list):
        return "(" + ", ".join(number(v, factor) for v in value) + ")"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, (int, float)):
        return str(value)
    scaled = value * factor
    return f"{scaled:.0f}" if 100 <= abs(scaled) < 1e5 else f"{scaled:.2g}" if abs(scaled) < 1 else (
        f"{scaled:.3g}"
    )  # fmt: skip


def short(parameters: dict[str, Any]) -> str:
    """Parameters in one line."""
    said = []
    for key, value in parameters.items():
        words, factor, unit = plain_key(key)
        said.append(f"{words} {number(value, factor)} {unit}".strip())
    return ", ".join(said)


def parameter_rows(result: Diagnosis) -> list[list[str]]:
    """Effect, quantity, value, 95 % interval and unit of what was named."""
    rows = []
    for entry in result.entries:
        for key, value in entry.parameters.items() if entry.name in result.effects else ():
            words, factor, unit = plain_key(key)
            low, high = entry.intervals.get(key, (None, None))
            span = "-" if low is None else f"{number(low, factor)} to {number(high, factor)}"
            rows.append([entry.name.replace("_", " "), words, number(value, factor), span, unit])
    return rows
