"""The story of a diagnosis: the answer, what it means, what to do, how sure it is; then the evidence."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from palpate.diagnosis.apply import improved
from palpate.diagnosis.search.site_stiffness import stands_open
from palpate.diagnosis.verdict.result import Diagnosis, parted
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.model.model import Model
from palpate.show import story as say
from palpate.show.diagnosis.figures import (
    curve_pictures,
    first_picture,
    gains_picture,
    modulus_picture,
    press_pictures,
    view,
)
from palpate.show.diagnosis.gaps import MOST_EFFECTS, diagnosed, gap_of, in_model, known, with_strain
from palpate.show.diagnosis.parameters import parameter_rows, short
from palpate.show.diagnosis.words import (
    AXIS_WORDS,
    ERROR_WORDS,
    answers,
    consequence,
    how_sure,
    limits,
    meaning,
    missing,
    named,
    touch_words,
    verdict,
    where,
)
from palpate.show.page import feel_step, file_words
from palpate.words import (
    chance_words,
    ended,
    estimate_words,
    force_words,
    kpa,
    percent,
    share_words,
    small,
    spaced,
    spoken,
    sure_kpa,
)

if TYPE_CHECKING:
    from palpate.diagnosis.other_simulator.result import SimulatedGap


def story(result: Diagnosis) -> say.Story:
    """The answer, what it is, what to do, how far it goes, where it shows, how sure it is; the evidence."""
    yield say.Title(f"Measured and simulated touch: {getattr(result.recording, 'name', '')}")
    ends = [f"{each} stands at the end of its range" for each in result.at_bound]
    yield say.Headline(f"verdict: {'; '.join([verdict(result), *ends])}", on=say.TEXT)
    yield from (say.TextLine(f"which: {named(result, name)}") for name in result.effects)
    yield from _how_far(result)
    _, there, because = where(result)
    yield say.TextLine(f"where: {small(there)}")
    yield say.Detail(because.replace(" (the press shown)", ""), on=say.TEXT)
    yield say.TextLine(f"how sure: {small(how_sure(result)[1])}")
    yield from (say.Note(reason, on=say.TEXT) for reason in result.reasons)
    if result.exact is not None:
        yield say.TextLine(f"touched places are solved: {result.exact.said}")
    if result.next_touch is not None and result.unsettled:
        yield say.TextLine(f"next touch: {touch_words(result)}")
    if not result.effects and (said := limits(result)):
        yield say.TextLine(said)
    if result.left_out:
        yield say.TextLine(f"not tried: {untried(result)}")
    yield say.Headline(verdict(result), on=say.PAGE)
    yield say.Section("", _means(result))
    yield say.Next(next_steps(result))
    yield say.Section("", _shown(result))
    if result.next_touch is not None:
        heading = "Where to touch next, to be sure?" if result.unsettled else "And if you touch it once more?"
        hangs = "" if result.unsettled else " It is optional: the answer above does not depend on it."
        once_more = [say.Sentence(f"{ended(touch_words(result))}{hangs}")]
        yield say.Section(heading, once_more, unfolded=result.unsettled)
    yield say.Section("How large is it?", _how_large(result))
    yield say.Section("What was tried?", _tried(result))
    yield say.Section("What does the difference depend on?", _follows(result))
    yield say.Section("What may the comparison itself get wrong?", _own_errors(result))


def _how_far(result: Diagnosis) -> say.Story:
    """In a terminal's lines."""
    off = f"how far: a typical touch is {force_words(result.gap_before_n)} off"
    noise = f"; the sensor's noise is {force_words(result.noise_n)}"
    if result.gap_closed is not None and result.gap_closed_ci95 is not None and result.effects:
        after = force_words(result.gap_after_n)
        if not missing(result):  # the model as it is has it
            off = f"how far: a typical touch is {after} off; without what the model has it would be"
            yield say.TextLine(f"{off} {force_words(result.gap_before_n)}{noise}")
        else:
            yield say.TextLine(f"{off}, {after} with what was found{noise}")
        share, between = estimate_words(result.gap_closed, *result.gap_closed_ci95)
        yield say.Detail(
            f"{share} of the gap above the noise is explained (95 % sure: {between}), at held-out places",
            on=say.TEXT,
        )
    else:
        yield say.TextLine(f"{off}{noise}")
    if result.constant_n is not None:
        constant = force_words(result.constant_n)
        yield say.Detail(f"a constant force instead of a model would be {constant} off", on=say.TEXT)


def _means(result: Diagnosis) -> say.Story:
    yield say.Detail(consequence(result, gap_of(result)[0].force_rms_n))


def _shown(result: Diagnosis) -> say.Story:
    """The answers side by side, and the object."""
    model = diagnosed(result)[1]
    yield say.Cards(answers(result))
    yield say.Turned(
        lambda: view(result), say.Picture(lambda: first_picture(model, result), _caption(result)), model
    )


def next_steps(result: Diagnosis) -> Iterator[str]:
    """What to do with the answer."""
    measured, model = diagnosed(result)
    recording = file_words(measured.path, "REC")
    asked = {e.name: e.domain for e in result.entries if e.name in missing(result)}
    instrument = [name for name, domain in asked.items() if domain == "instrument"]
    kept = [name for name in asked if name not in instrument and effect(name).rendered]
    no_model_holds = [name for name in asked if name not in (*instrument, *kept)]
    if model.path is not None:
        recording += f" --model {file_words(model.path, 'MODEL')}"
    if stands_open(model):
        yield (
            "first find how the shape stands: trace the table or touch its other faces; if its file is in "
            "the device's frame already, reconstruct with `--pose given`"
        )
    if result.next_touch is not None and result.unsettled:
        told = parted(result.next_touch.separates)
        yield f"make the next touch that is described here: it is to tell {told}"
    if kept:
        yield (
            f"put {spoken(kept)} into the model, and feel it: `palpate diagnose {recording} --apply BETTER`, "
            "then `palpate touch BETTER`"
        )
    if instrument:
        yield (
            f"take {spoken(instrument)} off the readings, since it is the instrument's and not the object's: "
            f"`palpate diagnose {recording} --corrected BETTER.csv.gz`"
        )
    if no_model_holds:
        yield f"explore again, and reconstruct: no model holds {spoken(no_model_holds)}"
    if not asked:
        yield feel_step(model.path, f"palpate reconstruct {recording} -o MODEL")


def _caption(result: Diagnosis) -> str:
    after = ", and with what was found" if result.effects else ""
    return (
        "Left: how far the simulated force is from the measured one around each place that was touched, in "
        "millinewtons (1 mN: the weight of a tenth of a gram). Right: measured and simulated force of one "
        f"press{after}."
    )


def _gains_caption(result: Diagnosis) -> str:
    simplest = "The simplest simulation has small deformations and one stiffness only"
    there = [n for n in result.effects if n in in_model(result)]
    has = f"; the model itself has {spoken(there)} already" if there else ""
    nothing = "" if result.effects else " Nothing that was tried is large and steady enough to be named."
    return f"{simplest}{has}. All at held-out places.{nothing}"


def _modulus_words(model: Model, result: Diagnosis) -> str:
    before, after = model.material.young_modulus_pa, result.young_modulus_pa
    ends = model.material.young_modulus_ci95_pa
    interval = f" ({sure_kpa(ends)})" if np.isfinite(ends).all() else ""
    return (
        f"Young's modulus: {kpa(before)} in the model{interval}, {kpa(after)} fitted anew with what was "
        f"found ({100 * (after / before - 1):+.1f} %)."
    )


def _how_large(result: Diagnosis) -> say.Story:
    model = diagnosed(result)[1]
    yield say.Picture(lambda: gains_picture(result), _gains_caption(result))
    rows = parameter_rows(result)
    if rows:
        yield say.Rows(["effect", "quantity", "found", "95 % sure between", "unit"], rows)
    yield say.Sentence(_modulus_words(model, result))
    yield from map(say.Note, result.reasons)
    if result.held_out_n:
        each = (
            f"at the places of the {k} presses the difference goes from {force_words(a)} to {force_words(b)}"
            for k, (a, b) in result.held_out_n.items()
        )
        yield say.Sentence(f"Left out on purpose: {'; '.join(each)}")
    better, _ = improved(model, result)
    if np.ptp(better.surface_ratio) > 0:
        yield say.Picture(
            lambda: modulus_picture(better, result),
            "Young's modulus right under the surface, with what was found (dots: places touched).",
        )


def _tried(result: Diagnosis) -> say.Story:
    strain = next((e.gap_closed for e in result.entries if e.name == known()), None)
    beside = {e.name: with_strain(result, e.name) for e in result.entries}
    marked = (
        f" Those marked + were tried together with {spaced(known())}, which every soft solid shows when "
        "it is pressed deep: only what they take away in addition counts."
    )
    yield say.Sentence(
        "Each effect was put into the simulation, fitted, and judged at held-out places. "
        "The best comes first. One as large as in 'named from' is named in 19 of 20 draws of such presses."
        f"{marked if any(beside.values()) else ''}"
    )
    yield say.Rows(
        [
            "effect",
            "what it means",
            "how likely",
            "difference left [mN]",
            "taken away",
            "named from [mN]",
            "fitted values",
        ],
        [
            [
                ("+ " if beside[e.name] else "") + spaced(e.name),
                meaning(e.name),
                percent(e.probability),
                f"{e.gap_after_n * 1e3:.0f}",
                _taken(e.gap_closed, strain if beside[e.name] else None),
                _from(e.detectable_n),
                short(e.parameters) if e.probability > 0.01 else "",
            ]
            for e in result.entries[:MOST_EFFECTS]
        ],
    )
    if rest := [e.name for e in result.entries[MOST_EFFECTS:]]:
        yield say.Sentence(f"Tried too, and less likely: {spoken(rest)}.")
    if result.confusable:
        pairs = (spoken((a, b)) for a, b, _ in result.confusable[:6])
        yield say.Sentence(f"With these touches the following look alike: {'; '.join(pairs)}")
    if result.left_out:
        yield say.Sentence(f"Not tried: {untried(result)}")


def untried(result: Diagnosis) -> str:
    """What was left out, and why: what takes long is tried without the quick setting, where it can show."""
    long = [name for name in result.left_out if effect(name).hints.expensive]
    unseen = [name for name in result.left_out if name not in long]
    said = [f"{spoken(unseen)} (these touches cannot show it)"] if unseen else []
    if long:
        said.append(f"{spoken(long)} (the quick setting leaves it out, or these touches cannot show it)")
    return "; ".join(said)


def _from(limit_n: float) -> str:
    return "" if np.isnan(limit_n) else f"{1e3 * limit_n:.0f}" if np.isfinite(limit_n) else "at no size"


def _taken(closed: float | None, strain: float | None) -> str:
    """A share of the gap that is taken away; beside finite strain, what comes on top of that."""
    if closed is None or strain is None:
        return share_words(closed)
    more = 100 * (closed - strain)
    return "nothing more" if more < 0.5 else f"{more:.0f}\u00a0% more"


def goes_with(result: Diagnosis | SimulatedGap, heading: str) -> say.Rows:
    """What the difference depends on, the most first."""
    return say.Rows(
        [heading, "share of it", "how often chance does this"],
        [
            [AXIS_WORDS[a.axis], percent(a.share), chance_words(a.p)]
            for a in sorted(result.where.axes, key=lambda a: -a.share)
        ],
    )


def _follows(result: Diagnosis) -> say.Story:
    yield goes_with(result, "the difference goes with")
    yield say.Pictures(curve_pictures(result))
    yield say.Sentence("The presses that differ most, after the one above:")
    yield say.Pictures(press_pictures(result))


def _own_errors(result: Diagnosis) -> say.Story:
    own = {k: v for k, v in result.errors_n.items() if k != "model"}
    yield say.Sentence(
        "As a typical (root mean square) force during touch. Sensor and repeatability are measured. The "
        "shape's is what its uncertainty may do before the forces are looked at; the fit weighs every place "
        "by it, and a modulus and first touches fitted along take up what all places have in common, so the "
        f"difference itself ({force_words(result.gap_before_n)}) may be smaller than it."
    )
    yield say.Rows(["source", "force [mN]"], [[ERROR_WORDS[k], f"{v * 1e3:.1f}"] for k, v in own.items()])
    if "model" in result.errors_n:
        yield say.Sentence(
            f"Where it was fitted, what was found leaves {force_words(result.errors_n['model'])} beyond the "
            "sensor's noise."
        )
