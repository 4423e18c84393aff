"""A diagnosis in words that need no knowledge of the program: the answer, what it means, how sure it is,
where it shows; quantities with units."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.diagnosis.verdict.result import Diagnosis, parted
from palpate.mechanics.effects.base import Scope
from palpate.mechanics.effects.registry import effect
from palpate.show.diagnosis.gaps import depth_contrast, in_model, press_gaps, worst_press
from palpate.show.diagnosis.parameters import short
from palpate.words import begun, estimate_words, force_words, listed, mm, percent, place_mm, spaced, spoken

AXIS_WORDS = {
    "depth": "how deep the press is",
    "rate": "how fast the press is",
    "phase": "whether the tip goes in, rests or comes out",
    "direction": "whether the force is sideways or into the surface",
    "space": "the place on the object",
    "order": "when in the session it was touched",
    "repeat": "whether a place is touched for the first time or again",
    "free_air": "what the sensor reads in free air, touching nothing",
}

ERROR_WORDS = {
    "sensor": "noise of the force sensor",
    "repeatability": "touching one place again does not give the same force",
    "shape": "the object's shape is not known where it was not touched",
}


def meaning(name: str) -> str:
    """What an effect is, for a person who has never heard of it."""
    return effect(name).plain_words or effect(name).words


MOST_SETS = 4
"""Of causes that words tell; the JSON holds all."""
FIRST_LIMITS = 3
"""Limits that the first screen of a page tells; the table of what was tried has each."""
LITTLE = 0.1
"""A share of the difference below which it is not said to depend on something."""


def missing(result: Diagnosis) -> tuple[str, ...]:
    """The effects that were named and that the model does not have yet."""
    return tuple(name for name in result.effects if name not in in_model(result))


def verdict(result: Diagnosis) -> str:
    """The answer in one sentence."""
    left_out, there = spoken(missing(result)), spoken([n for n in result.effects if n in in_model(result)])
    rivals = spoken(result.candidates, "or")
    if result.kind == "none" and rivals:
        return f"Measured and simulated force agree as far as these touches tell; {rivals} may be there."
    if result.kind == "none":
        return "Measured and simulated force agree: these touches show no missing effect."
    if result.kind == "unknown":
        return "Measured and simulated force differ, and nothing that this program knows explains it" + (
            f"; {rivals} is suspected." if rivals else "."
        )
    if not left_out and "unknown" in result.kind:
        known = f"what it knows is {there}, which the model already has"
        return f"The simulation leaves out something that this program does not know: {known}."
    if not left_out and rivals:
        return f"These touches show {there}, which the model already has; they cannot rule out {rivals}."
    if not left_out:
        said = f"Nothing new is missing: what these touches show is {there}, which the model already has"
    elif result.kind == "ambiguous" and rivals and not _likelier_than_not(result):
        what = spoken([*missing(result), *result.candidates], "or")
        return f"The simulation leaves something out, and these touches cannot tell what: {what}."
    elif result.kind == "ambiguous":
        said = f"The simulation leaves something out: most likely {left_out}"
    else:
        said = f"The simulation leaves out {left_out}"
    if left_out and there:
        said += f" (the model already has {there})"
    if result.kind == "ambiguous":
        return f"{said}; but these touches cannot rule out {rivals}."
    if "unknown" in result.kind:
        return f"{said}. Something else is missing that this program does not know."
    return f"{said}."


def _likelier_than_not(result: Diagnosis) -> bool:
    """Whether each effect that is named and missing is there by more than half of the odds."""
    named = missing(result)
    return all(e.probability > 0.5 for e in result.entries if e.name in named)


def consequence(result: Diagnosis, force_rms_n: float) -> str:
    """What the answer means for a hand. force_rms_n: typical force of a touch."""
    before, noise = force_words(result.gap_before_n), force_words(result.noise_n)
    size = f"{percent(result.gap_before_n / force_rms_n)} of its force"
    if result.kind == "none":
        return f"A typical touch is simulated to {before}, {size}; the sensor's noise alone is {noise}."
    told = missing(result) or result.effects
    words = "; ".join(_what_it_is(result, name) for name in told)
    said = f"{begun(words)}. " if words else ""
    if not result.effects:
        return f"A typical touch is off by {before}, {size}; the sensor's noise alone is {noise}."
    after, them = force_words(result.gap_after_n), "it" if len(result.effects) == 1 else "them"
    if result.gap_after_n >= 0.98 * result.gap_before_n:
        return f"{said}A typical touch is off by {before}, {size}, with or without {them}."
    near = result.gap_after_n < 1.25 * result.noise_n
    rest = f", about the sensor's noise ({noise})" if near else f"; the sensor's noise is {noise}"
    without = them if len(told) == len(result.effects) else spoken(result.effects)
    return (
        f"{said}Without {without} a simulated touch is typically off by {before}, {size}; with {them} by "
        f"{after}{rest}."
    )


def _what_it_is(result: Diagnosis, name: str) -> str:
    """An effect and its size: 'the tip slides instead of sticking (friction coefficient 0.12)'."""
    keys = next((e.parameters for e in result.entries if e.name == name), {})
    in_words = effect(name).keys_in_words
    said = in_words(keys) if in_words is not None and keys else short(keys)
    return meaning(name) + (f" ({said})" if said else "")


def answers(result: Diagnosis) -> list[tuple[str, str, str]]:
    """(question, answer, sentences) of how sure, where, how far."""
    return [how_sure(result), where(result), _how_far(result)]


AS_A_MODULUS = (
    "Sizes are what another modulus does not take up: a tool that gives, or a wrong gain of the force, makes "
    "the modulus itself wrong. Presses on the bare support show a tool that gives."
)


def how_sure(result: Diagnosis) -> tuple[str, str, str]:
    question = "How sure is it?"
    likely = result.explanations[:MOST_SETS]
    left = "; ".join(f"{percent(e.probability)} {_set(e.effects)}" for e in likely)
    if result.kind == "none":
        smaller = "Smaller ones may be there; deeper, faster or longer touches would show them."
        weighed = f"These touches leave open: {left}. " if result.candidates else ""
        text = f"{weighed}{begun(limits(result, FIRST_LIMITS))}. {smaller} {AS_A_MODULUS}"
        return question, "Larger effects would have been named", text
    if result.candidates:
        also = "; ".join(f"{spaced(n)}: {meaning(n)}" for n in result.candidates)
        text = f"Not ruled out: {also}. By these touches: {left}. The touch proposed below would decide it."
        return question, "These touches cannot decide", text
    if not result.effects:
        return question, "The gap is there, its cause is open", (
            "None of the effects that were tried takes it away at held-out places."
        )  # fmt: skip
    sure = {e.name: e.probability for e in result.entries if e.name in result.effects}
    text = (
        "All other sets of effects that were tried, and that nothing is missing, share the rest. "
        "How evidence counts was learnt from simulated recordings whose truth is known."
    )
    if len(sure) == 1 and "unknown" not in result.kind:
        return question, f"{percent(sum(sure.values()))} sure", text
    each = ", ".join(f"{spaced(name)} {percent(share)}" for name, share in sure.items())
    return question, begun(each), text


def _set(names: Sequence[str]) -> str:
    """A set of causes in words."""
    return " and ".join(map(spaced, names)) or "nothing that is missing"


def limits(result: Diagnosis, most: int | None = None) -> str:
    """From which size on each effect would have been named, the smallest first, and what never would; most:
    so many of the smallest, and the largest."""
    known = {e.name: e.detectable_n for e in result.entries if not np.isnan(e.detectable_n)}
    never = [name for name, limit in known.items() if np.isinf(limit)]
    ranked = sorted((n for n in known if n not in never), key=lambda n: known[n])
    shown = ranked if most is None or len(ranked) <= most + 1 else [*ranked[:most], ranked[-1]]
    each = [f"{spaced(n)} from {force_words(known[n])}" for n in shown]
    if len(shown) < len(ranked):
        each.insert(most or 0, f"{len(ranked) - len(shown)} others (What was tried?)")
    from_size = listed(each)
    said = [f"named in 19 of 20 such recordings would be {from_size}"] if ranked else []
    said += [f"at no size {spoken(never)}"] if never else []
    return "; ".join(said)


def where(result: Diagnosis) -> tuple[str, str, str]:
    """Where it differs, told so that it fits what was named: a component of the force is no cause."""
    axis = result.where.leading
    *there_m, rms = result.where.worst[0]
    if result.forward is not None:  # of the press that is shown, as the view says it
        rms = float(press_gaps(result)[worst_press(result)])
    largest = place_mm(there_m)
    question = "Where does it show?"
    # the gap of held-out places may exceed what a fit leaves at the worst place: the smaller one is not said
    size = f": {force_words(rms)}" if rms > result.gap_before_n else ""
    there = f"It is largest at {largest} (the press shown){size}."
    if result.kind == "none":
        none = "No place, depth or speed stands out beyond what noise, first touch and shape may do."
        return question, "Nowhere in particular", f"{none} {there}"
    if axis.share < LITTLE:
        most = f"It depends most on {AXIS_WORDS[axis.axis]}, which explains {percent(axis.share)} of it."
        return question, "Everywhere alike", f"{most} {there}"
    chance = "" if axis.p < 0.05 else " Chance alone would often give such a share."
    if axis.axis != "direction":
        text = f"{percent(axis.share)} of the difference depends on it.{chance} {there}"
        return question, f"It changes with {AXIS_WORDS[axis.axis]}", text
    text = f"{percent(axis.share)} of the difference lies along the surface, not into it.{chance} "
    headline, times = "In the sideways force", depth_contrast(result)
    of_depth = any(effect(n).scope in (Scope.PRESS, Scope.EVERYWHERE) for n in result.effects)
    if of_depth and np.isfinite(times) and times > 1.5:
        headline += " of deep presses"
        text += f"In the deepest third of the touches it is {times:.1f} times that in the shallowest. "
    return question, headline, text + there


def _how_far(result: Diagnosis) -> tuple[str, str, str]:
    question = "How far does it shrink?"
    before, noise = force_words(result.gap_before_n), force_words(result.noise_n)
    typical = "Root mean square at held-out places"
    if result.effects and result.gap_closed is not None and result.gap_closed_ci95 is not None:
        share, between = estimate_words(result.gap_closed, *result.gap_closed_ci95)
        after = force_words(result.gap_after_n)
        if result.gap_after_n >= 0.98 * result.gap_before_n:
            return question, f"{before}, and not less", (
                f"{typical}. What was found does not lower it there. The sensor's own noise is {noise}."
            )  # fmt: skip
        text = (
            f"{typical}. The sensor's own noise is {noise}: {share} of the gap above it is "
            f"explained (95 % sure: {between})."
        )
        return question, f"From {before} to {after}", text
    text = f"{typical}: {before}. The sensor's own noise is {noise}."
    if result.kind == "none":
        return question, "There is no gap to shrink", text
    return question, f"It stays at {before}", text + " No effect was found that explains it."


def named(result: Diagnosis, name: str) -> str:
    """An effect that was named, what it is, and whether the model has it already."""
    there = ", which the model already has" if name in in_model(result) else ""
    return f"{spaced(name)}: {_what_it_is(result, name)}{there}"


def short_verdict(kind: str, effects: Sequence[str], candidates: Sequence[str]) -> str:
    """In a few words: 'viscoelasticity', 'force bias or force drift', 'none'."""
    said = [*map(spaced, effects), *(["something unknown"] if "unknown" in kind else [])]
    if candidates and not said and kind != "none":
        said = [spoken(candidates, "or")]
    return listed(said) or kind


def touch_words(result: Diagnosis) -> str:
    """Where and how to touch next, and what that would tell."""
    touch = result.next_touch
    assert touch is not None
    told = parted(touch.separates)
    if touch.kind != "press":
        return f"to separate {told}: {touch.why}"
    direction = ", ".join(f"{round(d, 2) + 0.0:g}" for d in touch.direction)
    hold = f", and hold for {touch.hold_s:.1f} s" if touch.hold_s > 0.05 else ""
    return (
        f"to separate {told}, press at {place_mm((touch.x, touch.y, touch.z))} in the direction "
        f"({direction}), "
        f"{mm(touch.depth_m, '.1f')} deep at {mm(touch.speed_m_per_s, '.0f')}/s{hold}: {touch.why}"
    )
