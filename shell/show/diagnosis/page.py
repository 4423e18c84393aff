"""The report of a diagnosis: the answer, what it means, what to do, how sure it is; then the evidence."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from palpate.diagnosis.apply import improved
from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.model.model import Model
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
    chance_words,
    consequence,
    force_words,
    meaning,
    missing,
    percent,
    share_words,
    spoken,
    touch_words,
    verdict,
)
from palpate.show.page import Page, file_words


def report(result: Diagnosis, path: Path | str) -> Path:
    """Write one self-contained HTML page; returns its path."""
    recording, model = diagnosed(result)
    typical = gap_of(result)[0].force_rms_n
    page = Page(f"Measured and simulated touch: {recording.name}")
    page.lead(verdict(result))
    page.paragraph(consequence(result, typical))
    page.next_steps(next_steps(result))
    page.cards(answers(result))
    page.view(view(result), first_picture(model, result), _caption(result), model)
    page.figure(gains_picture(result), _gains_caption(result))
    _next_touch(page, result)
    _how_large(page, model, result)
    _moduli(page, model, result)
    _tried(page, result)
    _follows(page, result)
    _own_errors(page, result)
    page.result(result.as_json())
    return page.write(path)


def next_steps(result: Diagnosis) -> list[str]:
    """What to do with the answer."""
    measured, model = diagnosed(result)
    recording = file_words(measured.path, "REC")
    asked = {e.name: e.domain for e in result.entries if e.name in missing(result)}
    kept = [name for name, domain in asked.items() if domain != "instrument"]
    instrument = [name for name, domain in asked.items() if domain == "instrument"]
    said = []
    if model.path is not None:
        recording += f" --model {file_words(model.path, 'MODEL')}"
    if kept:
        said.append(
            f"put {spoken(kept)} into the model, and feel it: `palpate diagnose {recording} --apply BETTER`, "
            "then `palpate touch BETTER`"
        )
    if instrument:
        said.append(
            f"take {spoken(instrument)} off the readings, since it is the instrument's and not the object's: "
            f"`palpate diagnose {recording} --corrected BETTER.csv.gz`"
        )
    if not said:
        said.append(f"feel it: `palpate touch {file_words(model.path, 'MODEL')}`")
    if result.next_touch is not None and result.unsettled:
        said.append("touch once more where it says below, which would settle what is open")
    return said


def _caption(result: Diagnosis) -> str:
    after = ", with what was found (dashed)" if result.effects else ""
    return (
        "Left: how far the simulated force is from the measured one around each place that was touched, in "
        "millinewtons (1 mN: the weight of a tenth of a gram). Right: measured and simulated force of one "
        f"press{after}."
    )


def _gains_caption(result: Diagnosis) -> str:
    simplest = "The simplest simulation knows small deformations of one stiffness alone"
    there = [n for n in result.effects if n in in_model(result)]
    has = f"; the model itself has {spoken(there)} already" if there else ""
    nothing = "" if result.effects else " Nothing that was tried is large and steady enough to be named."
    return f"{simplest}{has}. All at places that the fit had not seen.{nothing}"


def _next_touch(page: Page, result: Diagnosis) -> None:
    if result.next_touch is None:
        return
    page.heading("To be sure: touch here next" if result.unsettled else "If you touch it once more")
    hangs = "" if result.unsettled else " Nothing hangs on it: the answer above stands without."
    words = touch_words(result)
    page.paragraph(f"{words[0].upper()}{words[1:]}.{hangs}")


def _modulus_words(model: Model, result: Diagnosis) -> str:
    before, after = model.material.young_modulus_pa, result.young_modulus_pa
    low, high = model.material.young_modulus_ci95_pa
    known = np.isfinite([low, high]).all()
    return (
        f"Young's modulus: {before / 1e3:.2f} kPa in the model"
        + (f" (95 % sure: {low / 1e3:.2f} to {high / 1e3:.2f} kPa)" if known else "")
        + f", {after / 1e3:.2f} kPa fitted anew with what was found ({100 * (after / before - 1):+.1f} %)."
    )


def _how_large(page: Page, model: Model, result: Diagnosis) -> None:
    page.heading("How large")
    rows = parameter_rows(result)
    if rows:
        page.table(["effect", "quantity", "found", "95 % sure between", "unit"], rows)
    page.paragraph(_modulus_words(model, result))
    for reason in result.reasons:
        page.paragraph(reason[0].upper() + reason[1:] + ".")
    if result.held_out_n:
        page.paragraph(
            "Left out on purpose: "
            + "; ".join(
                f"at the places of the {k} presses the difference goes from {force_words(a)} to "
                f"{force_words(b)}"
                for k, (a, b) in result.held_out_n.items()
            )
            + "."
        )


def _moduli(page: Page, model: Model, result: Diagnosis) -> None:
    better, _ = improved(model, result)
    if np.ptp(better.surface_ratio) > 0:
        page.figure(
            modulus_picture(better, result),
            "Young's modulus right under the surface, with what was found (dots: places touched).",
        )


def _tried(page: Page, result: Diagnosis) -> None:
    page.heading("Everything that was tried")
    strain = next((e.gap_closed for e in result.entries if e.name == known()), None)
    both = any(with_strain(result, e.name) for e in result.entries)
    page.paragraph(
        "Each effect was put into the simulation, fitted, and judged at places that the fit had not seen. "
        "The best comes first."
        + (
            f" Those marked + were tried beside {known().replace('_', ' ')}, which every soft solid shows "
            "when it is pressed deep; of them only what they take away on top of that counts."
            if both
            else ""
        )
    )
    page.table(
        ["effect", "what it means", "how likely", "difference left [mN]", "taken away", "fitted values"],
        [
            [
                ("+ " if with_strain(result, e.name) else "") + e.name.replace("_", " "),
                meaning(e.name),
                percent(e.probability),
                f"{e.gap_after_n * 1e3:.0f}",
                _taken(e.gap_closed, strain if with_strain(result, e.name) else None),
                short(e.parameters) if e.probability > 0.01 else "",
            ]
            for e in result.entries[:MOST_EFFECTS]
        ],
    )
    if result.confusable:
        pairs = (spoken((a, b)) for a, b, _ in result.confusable[:6])
        page.paragraph("With these touches the following look alike: " + "; ".join(pairs) + ".")
    if result.left_out:
        words = "Not tried, as such touches cannot show it or the fast setting leaves it out"
        page.paragraph(f"{words}: {spoken(result.left_out)}.")


def _taken(closed: float | None, strain: float | None) -> str:
    """A share of the gap that is taken away; beside finite strain, what comes on top of that."""
    if closed is None or strain is None:
        return share_words(closed)
    more = 100 * (closed - strain)
    return "nothing more" if more < 0.5 else f"{more:.0f}\u00a0% more"


def _follows(page: Page, result: Diagnosis) -> None:
    page.heading("What the difference goes with")
    page.table(
        ["the difference goes with", "share of it", "how often chance does this"],
        [
            [AXIS_WORDS[a.axis], percent(a.share), chance_words(a.p)]
            for a in sorted(result.where.axes, key=lambda a: -a.share)
        ],
    )
    page.figures(curve_pictures(result))
    page.paragraph("The presses that differ most, after the one above:")
    page.figures(press_pictures(result))


def _own_errors(page: Page, result: Diagnosis) -> None:
    page.heading("What the comparison itself may get wrong")
    own = {k: v for k, v in result.errors_n.items() if k != "model"}
    page.paragraph(
        "As a typical (root mean square) force during touch. Sensor and repeatability are measured. The "
        "shape's is what its uncertainty may do before the forces are looked at; the fit weighs every place "
        "by it, and a modulus and first touches fitted along take up what all places have in common, so the "
        f"difference itself ({force_words(result.gap_before_n)}) may be smaller than it."
    )
    page.table(["source", "force [mN]"], [[ERROR_WORDS[k], f"{v * 1e3:.1f}"] for k, v in own.items()])
    if "model" in result.errors_n:
        page.paragraph(
            f"Where it was fitted, what was found leaves {force_words(result.errors_n['model'])} beyond the "
            "sensor's noise."
        )
