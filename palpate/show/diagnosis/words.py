"""A diagnosis in words that need no knowledge of the program: the three answers, quantities with units."""

from __future__ import annotations

from diagnose.verdict.result import Diagnosis
from mechanics.effects.registry import effect
from palpate.show.diagnosis.parameters import short

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
        f"The difference is {there}"
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
            f"{percent(low)} to {percent(high)})."
        )
        return question, f"From {before} to {after}", text
    text = f"{typical}: {before} ({size}). The sensor's own noise is {noise}."
    if result.kind == "none":
        return question, "There is nothing to shrink", text
    return question, f"It stays at {before}", text + " With no effect found, nothing of it is gone."
