"""Another simulator's gap: the parts as bars, the object coloured by the gap, and the page."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.diagnosis.numerics.registry import NAMES, numerical
from palpate.diagnosis.other_simulator.result import PARTS, SimulatedGap
from palpate.diagnosis.verdict.result import Diagnosis, EffectEntry
from palpate.mechanics.effects.base import Effect
from palpate.mechanics.effects.registry import effect
from palpate.show.diagnosis import place as place_gap
from palpate.show.diagnosis.figures import curve_pictures, first_picture, press_pictures
from palpate.show.diagnosis.figures import view as view_of_gap
from palpate.show.diagnosis.parameters import number, plain_key, short
from palpate.show.diagnosis.words import AXIS_WORDS, chance_words, force_words, percent, share_words, spoken
from palpate.show.page import Page, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

    from palpate.show.view3d import View

COLOURS = {
    "numerics": "#1d3557", "parameters": "#2a9d8f", "reality": "#e76f51", "unexplained": "#c9c9c9",
}  # fmt: skip
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
    return view_of_gap(as_diagnosis(result))


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
        return short({k: "none: it sticks" if v is None else v for k, v in keys.items()}, WORDS)
    in_words = _effect(entry.name).keys_in_words
    if in_words is not None and keys:
        return in_words(keys)
    return short(keys, WORDS if entry.name in NAMES else {})


def _effect(name: str) -> Effect:
    return numerical(name) if name in NAMES else effect(name)


LITTLE = 0.5
"""Share of a gap, above which one that nothing explains is said first."""
SHOWN = 0.02
"""Share of a gap that a bar can show."""
_MOST = {
    "numerics": "most of the gap is numerics",
    "parameters": "most of the gap is parameters",
    "reality": "most of the gap is what every ideal elastic simulation lacks",
}


def verdict(result: SimulatedGap) -> str:
    """The answer in one sentence."""
    first = max(PARTS, key=lambda name: result.parts[name].share)
    if settled := _settled(result):
        most = f"most of the gap is numerics: {settled}"
    elif not result.effects:
        return "nothing stands out: neither numerics nor parameters nor what an ideal simulation lacks"
    elif result.unexplained > result.parts[first].share:
        most = "most of the gap is not explained"
    else:
        most = _MOST[first]
    rivals = f" (not ruled out: {spoken(result.candidates, 'or')})" if result.candidates else ""
    return f"{most}; named: {spoken(result.effects) or 'nothing'}{rivals}"


def lines(result: SimulatedGap) -> list[str]:
    """What `print` says: the answer, its three parts, what to mend, then what the simulator was given."""
    after = f"{force_words(result.gap_after_n)} once all of it is mended, at places that were not fitted"
    text = [
        f"verdict: {verdict(result)}",
        f"gap: simulated and measured force differ by {force_words(result.gap_before_n)} (the sensor's "
        f"noise: {force_words(result.noise_n)}); {after}",
        "  its parts, and their shares of its mean square:",
    ]
    for name in PARTS:
        part = result.parts[name]
        said = f"  {name}, {MEANING[name]}: {force_words(part.gap_n)}, {percent(part.share)}"
        text.append(
            ": ".join([said, *(["; ".join(_named(result, part.names, _spaced))] if part.names else [])])
        )
    text.append(
        f"  unexplained: {force_words(result.unexplained_n)}, {percent(result.unexplained)} (the sensor's "
        f"noise {percent(result.noise_share)}, first touches {percent(result.touch_share)})"
    )
    if result.mended is not None:
        text.append(f"run again with {result.mended.settings}: {mended_words(result)}")
    text += [f"advice: {each}" for each in result.advice]
    given, about = result.simulator.stated, result.simulator
    said = ", ".join(
        f"{words} {shown} {unit}".rstrip() + ("" if key in given.given else " (not stated: the model's)")
        for key, words, shown, unit in _given(result)
    )
    text.append(f"given to {about.name}{' ' + about.version if about.version else ''}: {said}")
    text += [f"  note: {note}" for note in result.notes]
    text += [f"  {reason}" for reason in result.reasons]
    return [line.replace("\u00a0", " ") for line in text]


def mended_words(result: SimulatedGap) -> str:
    """What the run with mended settings measured, beside what was said of it; '' where there is none."""
    if result.mended is None:
        return ""
    return (
        f"the gap went from {force_words(result.gap_before_n)} to {force_words(result.mended.gap_n)} "
        f"({force_words(result.without_numerics_n)} was said once its numerics are mended); still named: "
        f"{spoken(result.mended.effects) or 'nothing'}"
    )


def _spaced(name: str) -> str:
    return name.replace("_", " ")


def _named(result: SimulatedGap, names: Sequence[str], words: Callable[[str], str] = meaning) -> list[str]:
    """Effects in words, each with its numbers."""
    numbers = {e.name: keys_in_words(e) for e in result.entries}
    return [words(name) + (f" ({numbers[name]})" if numbers.get(name) else "") for name in names]


def _given(result: SimulatedGap) -> list[tuple[str, str, str, str]]:
    """(key, words, value, unit) of what the simulator was given."""
    rows = []
    for key, value in result.simulator.stated.as_json().items():
        words, factor, unit = plain_key(key, value)
        rows.append((key, words, "none: it sticks" if value is None else number(value, factor), unit))
    return rows


def lead(result: SimulatedGap) -> str:
    """The page's first words: how far off, and by what most; or that most of it is not explained."""
    off, left = f"It is off by {force_words(result.gap_before_n)}", _open(result)
    most = max(part.share for part in result.parts.values())
    said = _named(result, result.effects[:2])
    if settled := _settled(result):
        shown = f" What shows of it: {said[0]}." if said else ""
        return f"{off}; {settled}, so most of that is numerics.{shown}"
    if not said:
        if left > LITTLE:
            return f"{off}, and nothing that is known here explains {percent(left)} of that."
        return "Nothing stands out: this simulation is as near to the measured forces as they can tell."
    if left > most:
        return f"{off}, and {percent(left)} of that is not explained. A smaller part is: {said[0]}."
    return f"{off}. Above all: {'; then: '.join(said)}." + (
        f" Not ruled out: {spoken(result.candidates, 'or')}." if result.candidates else ""
    )


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


def _cards(result: SimulatedGap) -> list[tuple[str, str, str]]:
    cards = []
    for name in PARTS:
        part = result.parts[name]
        text = "; ".join(_named(result, part.names)) or "nothing is named here"
        cards.append(
            (
                f"{name.capitalize()}: {MEANING[name]}",
                f"{force_words(part.gap_n)}, {percent(part.share)}",
                text[0].upper() + text[1:] + ".",
            )
        )
    return cards


def report(result: SimulatedGap, path: Path | str) -> Path:
    """Write one self-contained HTML page; returns its path."""

    shown = as_diagnosis(result)
    assert result.reality.model is not None and result.reality.recording is not None
    page = Page(f"{result.simulator.name} against measured touch: {result.reality.recording.name}")
    page.lead(lead(result))
    page.next_steps(result.advice)
    page.cards(_cards(result))
    if result.mended is not None:
        page.paragraph(f"Run again with {result.mended.settings}: {mended_words(result)}.")
    for note in result.notes:
        page.paragraph(f"Note: {note}.")
    if sum(share > SHOWN for share in (result.unexplained, *(p.share for p in result.parts.values()))) > 1:
        figure = new_figure(9, 1.7, layout="constrained")
        draw(result, figure.subplots())
        page.figure(
            figure,
            "Taken off one after another, at places that no fit has seen: numerics, parameters, then what "
            f"every ideal simulation lacks. Of what is left {percent(result.noise_share)} is the sensor's "
            f"noise and {percent(result.touch_share)} where exactly the object was first met.",
        )
    page.view(
        view_of_gap(shown),
        first_picture(result.reality.model, shown),
        "Left: how far this simulator is from the measured force around each place. Right: one press, "
        "measured, simulated, and (dashed) with all that is named mended.",
        result.reality.model,
    )
    _stated(page, result)
    _tried(page, result)
    page.heading("What the difference depends on")
    page.table(
        ["the difference depends on", "share of it", "how often chance does this"],
        [
            [AXIS_WORDS[a.axis], percent(a.share), chance_words(a.p)]
            for a in sorted(result.where.axes, key=lambda a: -a.share)
        ],
    )
    page.figures(curve_pictures(shown))
    page.figures(press_pictures(shown))
    for reason in result.reasons:
        page.paragraph(reason[0].upper() + reason[1:] + ".")
    page.result(result.as_json())
    return page.write(path)


def _stated(page: Page, result: SimulatedGap) -> None:
    page.heading("What the simulator was given")
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
        shown = [
            ("it sticks" if v is None else v if v == "" else number(v, factor)) for v in (value, measured)
        ]
        said = "stated" if key in given.given else "not stated: the model's"
        own = "agrees" if key in given.given else "-"
        rows.append([words, shown[0], said, shown[1] or own, unit])
    page.table(["parameter", "given", "by whom", "the recording says", "unit"], rows)


def _tried(page: Page, result: SimulatedGap) -> None:
    page.heading("What was tried")
    page.paragraph(
        "Each flaw of a simulator was held against the difference between its force and our own law's at the "
        "parameters that it was given, where no sensor's noise stands in the way, and judged at places that "
        "the fit had not seen. The difference left is that to the measured force once this alone is mended: "
        "of two flaws that hide one another it can be more than before. A flaw that takes much away and is "
        "unlikely is a worse account of the same than those that are named."
    )
    page.table(
        ["effect", "kind", "what it means", "how likely", "difference left [mN]", "taken away", "values"],
        [
            [
                e.name.replace("_", " "),
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
