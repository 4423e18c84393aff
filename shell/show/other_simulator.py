"""Another simulator's gap: the parts as bars, the object coloured by the gap, and the page."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from palpate.diagnosis.numerics.registry import NAMES, numerical
from palpate.diagnosis.other_simulator.frame import AS_RECORDED
from palpate.diagnosis.other_simulator.result import PARTS, GapPart, SimulatedGap
from palpate.diagnosis.verdict.result import Diagnosis, EffectEntry
from palpate.mechanics.effects.base import Effect
from palpate.mechanics.effects.registry import effect
from palpate.show import story as say
from palpate.show.colours import COLOURS
from palpate.show.diagnosis import place as place_gap
from palpate.show.diagnosis.figures import curve_pictures, first_picture, press_pictures
from palpate.show.diagnosis.figures import view as view_of_gap
from palpate.show.diagnosis.parameters import number, plain_key, short
from palpate.show.diagnosis.story import goes_with
from palpate.show.diagnosis.words import where
from palpate.show.page import drawn
from palpate.words import begun, force_words, percent, sentence, share_words, small, spaced, spoken

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

    from palpate.show.view3d import View

_OTHER = "other-simulator"
MEANING = {
    "numerics": "what the simulator adds of its own",
    "parameters": "what it was given wrongly",
    "reality": "what every ideal elastic simulation lacks",
}
STATED = {
    "stated_modulus": "the Young's modulus that it was given",
    "stated_poisson_ratio": "the Poisson's ratio that it was given",
    "stated_friction": "the friction that it was given",
    "stated_tip_radius": "the radius of the tip that it was given",
}
WORDS = {  # of keys of STATED and of numerical effects; physical effects have those of a diagnosis
    "share": "share",
    "never_felt": "of it never felt at all",
    "from_depth_m": "from a depth of",
    "effective_radius_m": "no contact is smaller than a patch of radius",
    "late_m": "and met late by",
    "stiffness_n_per_m": "stiffness of the contact",
    "damping_n_s_per_m": "damping",
    "delay_s": "late by",
    "offset_m": "the surface stands off by",
    "velocity_m_per_s": "it wanders by, x y z",
    "stated": "given",
    "measured": "measured",
}
STICKING = "unlimited: the tip sticks"


def as_diagnosis(result: SimulatedGap) -> Diagnosis:
    """The same in the form of a diagnosis of our own model, for its pictures: measured against this
    simulator's force, and with all that is named mended."""
    forward = copy.copy(result.reality.forward)
    assert forward is not None, "only what `diagnose` returned holds its touches"
    measured = result.gaps["simulated"] + result.simulated
    touches = result.touches
    frame = touches.frame[touches.press]
    forward.touches = dataclasses.replace(touches, force=np.einsum("nij,ni->nj", frame, measured))
    return dataclasses.replace(
        result.reality,
        forward=forward,
        attribution=None,
        residual_before=result.gaps["simulated"],
        residual_after=result.gaps["reality"],
        where=result.where,
        kind=result.kind,
        effects=result.effects,
        candidates=result.candidates,
        entries=result.entries,
    )


def draw(result: SimulatedGap, ax: Axes) -> None:
    """The gap's square, cut into its parts."""
    left, rows = 0.0, [*PARTS, "unexplained"]
    for name in rows:
        share = result.unexplained if name == "unexplained" else result.parts[name].share
        width = max(share, 0.0)
        ax.barh([0], [width], left=left, color=COLOURS[name], label=f"{name} {percent(share)}", height=0.6)
        left += width
    words = f"share of the mean square of the gap of {force_words(result.gap_before_n)}"
    ax.set(yticks=[], xlim=(0, max(left, 1.0)), xlabel=words)
    ax.legend(ncols=4, frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=9)
    ax.spines[["top", "right", "left"]].set_visible(False)


def view(result: SimulatedGap) -> View:
    """The object by its gap; each press as measured, simulated, and with all that is named mended."""
    return view_of_gap(as_diagnosis(result), _OTHER)


def place(result: SimulatedGap, plotter: Plotter) -> None:
    """The object coloured by the gap."""
    place_gap(as_diagnosis(result), plotter)


def meaning(name: str) -> str:
    """What a flaw, a parameter or an effect is, in plain words."""
    if name in STATED:
        return STATED[name]
    known = _effect(name)
    return known.plain_words or known.words


def keys_in_words(entry: EffectEntry) -> str:
    """An entry's numbers with units that a hand knows. What a key means is for its effect to say: `ratio` is
    one number of a mesh, and a list of a stiffness field."""
    keys = entry.parameters
    if entry.name in STATED:
        return short({k: STICKING if v is None else v for k, v in keys.items()}, WORDS)
    in_words = _effect(entry.name).keys_in_words
    if in_words is not None and keys:
        return in_words(keys)
    return short(keys, WORDS if entry.name in NAMES else {})


def _effect(name: str) -> Effect:
    return numerical(name) if name in NAMES else effect(name)


LITTLE = 0.5
"""Share of a gap, above which one that nothing explains is said first."""
LEAST_SHARE = 0.005
"""Share of a gap that is rounded to none."""
SHOWN = 0.02
"""Share of a gap that a bar can show."""
_MOST = {
    "numerics": "most of the gap is numerics",
    "parameters": "most of the gap is parameters",
    "reality": "most of the gap is what every ideal elastic simulation lacks",
}


BODY = "the body's stiffness"


def told_effects(result: SimulatedGap) -> list[str]:
    """What is named; what forces alone do not part is one thing."""
    return [BODY if result.body_alone and n == "mesh_stiffness" else n for n in result.effects]


def told_rivals(result: SimulatedGap) -> list[str]:
    """What is not ruled out beside it."""
    return [n for n in result.candidates if not (result.body_alone and n == "stated_modulus")]


def verdict(result: SimulatedGap) -> str:
    """The answer in one sentence."""
    if result.coarse:
        told = spoken(told_effects(result)) or "nothing"
        return f"no verdict yet: {result.coarse}; until then do not mend what is named: {told}"
    first = max(PARTS, key=lambda name: result.parts[name].share)
    if settled := _settled(result):
        most = f"most of the gap is numerics: {settled}"
    elif not result.effects:
        return "nothing stands out: neither numerics nor parameters nor what an ideal simulation lacks"
    elif result.unexplained > result.parts[first].share:
        most = "most of the gap is not explained"
    elif result.body_alone and first == "numerics":
        most = f"above all {_of_body(result)}"
    else:
        most = _MOST[first]
    rivals = f" (not ruled out: {spoken(told_rivals(result), 'or')})" if told_rivals(result) else ""
    return f"{most}; named: {spoken(told_effects(result)) or 'nothing'}{rivals}"


def _of_body(result: SimulatedGap) -> str:
    """A stiffness of the whole body, the simplest cause first."""
    keys = next(e.parameters for e in result.entries if e.name == "mesh_stiffness")
    softer = keys["ratio"] < 1 and "contact_stiffness" not in result.candidates
    ruled_out = "; a softer contact is ruled out" if softer else ""
    return (
        f"the body is {keys['ratio']:.2g} times as stiff: its modulus, which nobody stated, or the "
        f"mesh's stiffness{ruled_out}"
    )


def story(result: SimulatedGap) -> say.Story:
    """The answer, its three parts, what to mend, what the simulator was given; the evidence."""
    yield say.Title(
        f"{result.simulator.name} against measured touch: {getattr(result.reality.recording, 'name', '')}"
    )
    yield say.Headline(f"verdict: {verdict(result)}", on=say.TEXT)
    yield say.Headline(lead(result), on=say.PAGE)
    yield say.Sentence(_how_sure(result), on=say.PAGE)
    read_as = result.simulator.axes, result.simulator.unit
    if read_as != (AS_RECORDED, "N"):
        yield say.Sentence(f"its forces are read as {' in '.join(read_as)}, not x,y,z in N (see the notes)")
    yield say.Next(result.advice, on=say.PAGE)
    yield from _parts(result)
    _, there, because = where(as_diagnosis(result))
    yield say.TextLine(f"where: {small(there)}")
    yield say.Detail(because.replace(" (the press shown)", ""), on=say.TEXT)
    yield from (say.Sentence(words) for words in _against_its_best(result))
    if result.mended is not None:
        again = f"run again with {result.mended.settings}: {mended_words(result)}"
        yield say.Sentence(again)
    yield from (say.TextLine(f"advice: {each}") for each in result.advice)
    about = result.simulator
    given = ", ".join(
        f"{words} {shown} {unit}".rstrip()
        + ("" if key in about.stated.given else " (not stated: the model's)")
        for key, words, shown, unit in _given(result)
    )
    version = f" {about.version}" if about.version else ""
    yield say.TextLine(f"given to {about.name}{version}: {given}")
    yield from (say.Note(f"note: {note}") for note in result.notes)
    yield from (say.Note(reason, on=say.TEXT) for reason in result.reasons)
    yield from _seen(result)
    shares = (result.unexplained, *(part.share for part in result.parts.values()))
    if sum(share > SHOWN for share in shares) > 1:
        bars = say.Picture(
            lambda: drawn(draw, result, 9, 1.7),
            "Taken off one after another, at held-out places: numerics, parameters, then what "
            f"every ideal simulation lacks. Of the remaining gap {percent(result.noise_share)} is the "
            f"sensor's "
            f"noise and {percent(max(result.touch_share, 0.0))} where exactly the object was first met.",
        )
        yield say.Section("How large is each part?", [bars])
    yield say.Section("What was the simulator given?", _stated(result))
    yield say.Section("What was tried?", _tried(result))
    yield say.Section("What does the difference depend on?", _depends(result))


def _parts(result: SimulatedGap) -> say.Story:
    """How far it is off, and what of that is numerics, parameters, reality."""
    after = f"{force_words(result.gap_after_n)} once all of it is mended, at places that were not fitted"
    yield say.TextLine(
        f"gap: simulated and measured force differ by {force_words(result.gap_before_n)}, "
        f"{percent(result.gap_before_n / result.touches.force_rms_n)} of the measured one (the sensor's "
        f"noise: {force_words(result.noise_n)}); {after}"
    )
    yield say.Detail("its parts, and their shares of its mean square:", on=say.TEXT)
    cards = []
    for name in PARTS:
        part = result.parts[name]
        size = part_words(part)
        if not part.names and abs(part.share) < LEAST_SHARE:
            size = "-"
        short_names = "; ".join(_named(result, part.names, spaced))
        yield say.Detail(f"{name}, {MEANING[name]}: {size}{short_names and f': {short_names}'}", on=say.TEXT)
        meant = "; ".join(_named(result, part.names)) or "nothing is named here"
        cards.append((f"{begun(name)}: {MEANING[name]}", size, sentence(meant)))
    yield say.Detail(
        f"unexplained: {force_words(result.unexplained_n)}, {percent(result.unexplained)} (the sensor's "
        f"noise {percent(result.noise_share)}, first touches {percent(max(result.touch_share, 0.0))})",
        on=say.TEXT,
    )
    yield say.Cards(cards)


def part_words(part: GapPart) -> str:
    """What a part adds to the gap, and its share of the mean square; one that takes off adds nothing that has
    a size, and hides another error."""
    if part.share > -LEAST_SHARE:
        return f"{force_words(part.gap_n)}, {percent(part.share)}"
    return (
        f"hides another error: mended alone, it leaves the gap's mean square larger by {percent(-part.share)}"
    )


def _against_its_best(result: SimulatedGap) -> list[str]:
    """What it has of its own, and which errors make up for each other."""
    said, own = [], result.own
    if own is not None:
        which = spoken(own.effects) or "nothing that has a name"
        others = f" (not ruled out: {spoken(own.candidates, 'or')})" if own.candidates else ""
        said.append(
            f"at its best settings it is {force_words(own.off_n)} off the law: {which}{others}; the numerics "
            "that are named come on top of that"
        )
    for pair in result.made_up:
        one, two = (
            f"{spaced(name)} ({force_words(alone)})"
            for name, alone in zip(pair.effects, pair.alone_n, strict=True)
        )
        together = force_words(pair.together_n)
        said.append(f"{one} and {two} make up for each other (together {together}): mend both, or neither")
    return said


def _seen(result: SimulatedGap) -> say.Story:
    """The object by the gap."""
    shown, model = as_diagnosis(result), result.reality.model
    assert model is not None
    yield say.Turned(
        lambda: view_of_gap(shown, _OTHER),
        say.Picture(
            lambda: first_picture(model, shown, _OTHER),
            "Left: how far this simulator is from the measured force around each place. Right: one press, "
            "measured, simulated, and (dashed) with all that is named mended.",
        ),
        model,
    )


def _depends(result: SimulatedGap) -> say.Story:
    shown = as_diagnosis(result)
    yield goes_with(result, "the difference depends on")
    yield say.Pictures(curve_pictures(shown))
    yield say.Pictures(press_pictures(shown, _OTHER))
    yield from map(say.Note, result.reasons)


def mended_words(result: SimulatedGap) -> str:
    """What the run with mended settings measured, beside what was said of it; '' where there is none."""
    if result.mended is None:
        return ""
    return (
        f"the gap went from {force_words(result.gap_before_n)} to {force_words(result.mended.gap_n)} "
        f"({force_words(result.without_numerics_n)} was said once its numerics are mended); still named: "
        f"{spoken(result.mended.effects) or 'nothing'}"
    )


def _named(result: SimulatedGap, names: Sequence[str], words: Callable[[str], str] = meaning) -> list[str]:
    """Effects in words, each with its numbers."""
    numbers = {e.name: keys_in_words(e) for e in result.entries}
    return [
        _of_body(result)
        if result.body_alone and name == "mesh_stiffness"
        else words(name) + (f" ({numbers[name]})" if numbers.get(name) else "")
        for name in names
    ]


def _given(result: SimulatedGap) -> list[tuple[str, str, str, str]]:
    """(key, words, value, unit) of what the simulator was given."""
    rows = []
    for key, value in result.simulator.stated.as_json().items():
        words, factor, unit = plain_key(key, value)
        rows.append((key, words, STICKING if value is None else number(value, factor), unit))
    return rows


def lead(result: SimulatedGap) -> str:
    """The page's first words: how far off, and by what most; or that most of it is not explained."""
    if result.coarse:
        return f"Not settled: {result.coarse}."
    off, left = f"It is off by {force_words(result.gap_before_n)}", _open(result)
    most = max(part.share for part in result.parts.values())
    said = _named(result, result.effects[:2])
    if settled := _settled(result):
        shown = f" What shows of it: {said[0]}." if said else ""
        return f"{off}; {settled}, so most of that is numerics.{shown}"
    if not said:
        if left > LITTLE:
            return f"{off}, and nothing that is known here explains {percent(left)} of that."
        return "Nothing stands out: this simulation is as near to the measured forces as they can show."
    if left > most:
        return f"{off}, and {percent(left)} of that is not explained. A smaller part is: {said[0]}."
    return f"{off}. Above all: {'; then: '.join(said)}." + (
        f" Not ruled out: {spoken(told_rivals(result), 'or')}." if told_rivals(result) else ""
    )


def _how_sure(result: SimulatedGap) -> str:
    """How large the gap is beside the force, and how likely each name is."""
    size = f"The gap is {percent(result.gap_before_n / result.touches.force_rms_n)} of the measured force"
    sure = [(e.name, percent(e.probability)) for e in result.entries if e.name in result.effects]
    each = ", ".join(f"{spaced(name)} {likely}" for name, likely in sure)
    return f"{size}. How sure each name is: {each}." if each else f"{size}."


def _settled(result: SimulatedGap) -> str:
    """How far a run with mended settings is off, in words, where that took away most of the gap and more than
    any part explains; else ''."""
    again = result.mended
    if again is None or not result.gap_before_n > 0:
        return ""
    gone = 1 - (again.gap_n / result.gap_before_n) ** 2
    if gone <= max(0.5, *(part.share for part in result.parts.values())):
        return ""
    return f"run again with {again.settings} it is off by {force_words(again.gap_n)}"


def _open(result: SimulatedGap) -> float:
    """Share of the gap that neither a part nor noise nor first touches explain."""
    return result.unexplained - result.noise_share - result.touch_share


def _stated(result: SimulatedGap) -> say.Story:
    given = result.simulator.stated
    wrong = {e.name: e for e in result.entries if e.domain == "parameters"}
    field = {
        "young_modulus_pa": "stated_modulus",
        "poisson_ratio": "stated_poisson_ratio",
        "friction": "stated_friction",
        "tip_radius_m": "stated_tip_radius",
    }
    rows = []
    for key, value in given.as_json().items():
        words, factor, unit = plain_key(key)
        entry = wrong.get(field[key])
        measured = "" if entry is None else entry.parameters["measured"]
        shown = [(STICKING if v is None else v if v == "" else number(v, factor)) for v in (value, measured)]
        said = "stated" if key in given.given else "not stated: the model's"
        own = "agrees" if key in given.given else "-"
        rows.append([words, shown[0], said, shown[1] or own, unit])
    yield say.Rows(["parameter", "given", "by whom", "the recording says", "unit"], rows)


def _tried(result: SimulatedGap) -> say.Story:
    yield say.Sentence(
        "Each flaw of a simulator was held against the difference between its force and our own law's at the "
        "parameters that it was given, where no sensor's noise stands in the way, and judged at held-out "
        "places. The difference left is that to the measured force once this alone is mended: "
        "of two flaws that hide one another it can be more than before. A flaw that takes much away and is "
        "unlikely is a worse account of the same than those that are named."
    )
    yield say.Rows(
        ["effect", "kind", "what it means", "how likely", "difference left [mN]", "taken away", "values"],
        [
            [
                spaced(e.name),
                e.domain,
                meaning(e.name),
                percent(e.probability),
                f"{e.gap_after_n * 1e3:.0f}",
                share_words(e.gap_closed),
                keys_in_words(e) if e.probability > 0.01 else "",
            ]
            for e in result.entries
            if e.domain in ("numerics", "parameters") or e.name in result.effects
        ],
    )
