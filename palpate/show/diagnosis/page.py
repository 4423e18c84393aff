"""The report of a diagnosis: the three answers on the first screen, with pictures, then the evidence."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from diagnose.apply import improved
from diagnose.verdict.result import Diagnosis
from mechanics.model import Model
from palpate.show.diagnosis.figures import (
    curves_picture,
    first_picture,
    gains_picture,
    modulus_picture,
    presses_picture,
    view,
)
from palpate.show.diagnosis.gaps import MOST_EFFECTS, beside, diagnosed, gap_of, with_strain
from palpate.show.diagnosis.parameters import parameter_rows, short
from palpate.show.diagnosis.words import (
    AXIS_WORDS,
    ERROR_WORDS,
    answers,
    force_words,
    meaning,
    percent,
    share_words,
    spoken,
    verdict,
)
from palpate.show.page import Page


def report(result: Diagnosis, path: Path | str) -> Path:
    """Write one self-contained HTML page; returns its path."""
    recording, model = diagnosed(result)
    t, _, _ = gap_of(result)
    typical = t.force_rms_n
    page = Page(f"Simulated touch against measured touch: {recording.name}")
    page.lead(verdict(result))
    page.cards(answers(result, typical))
    page.next_step(_what_next(result, model, recording.path or "REC"))
    page.view(view(result), first_picture(model, result), _caption(result), model)
    page.figure(gains_picture(result), _gains_caption(result))
    _next_touch(page, result)
    _modulus_after(page, model, result)
    _how_large(page, result)
    _moduli(page, model, result)
    _tried(page, result)
    _follows(page, result)
    _own_errors(page, result)
    return page.write(path)


def _what_next(result: Diagnosis, model: Model, recording: Path | str) -> str:
    """What to do with the answer, in a sentence."""
    kept = [e.name for e in result.entries if e.name in result.effects and e.domain != "instrument"]
    instrument = [e.name for e in result.entries if e.name in result.effects and e.domain == "instrument"]
    said = []
    if kept:
        said.append(
            f"feel the object with {spoken(kept)}: `palpate diagnose {recording} --apply BETTER`, then "
            "`palpate touch BETTER`"
        )
    if instrument:
        said.append(
            f"take {spoken(instrument)} off the readings: "
            f"`palpate diagnose {recording} --corrected BETTER.csv.gz`"
        )
    if not said:
        said.append(f"feel it: `palpate touch {model.path or 'MODEL'}`")
    if result.next_touch is not None and result.unsettled:
        said.append("touch once more where it says below, which would settle what is open")
    return "What to do next: " + "; ".join(said) + "."


def _caption(result: Diagnosis) -> str:
    after = ", with what was found (dashed)" if result.effects else ""
    return (
        "Left: how far the simulated force is from the measured one around each place that was touched, in "
        "millinewtons (1 mN: the weight of a tenth of a gram). Right: measured and simulated force of one "
        f"press{after}."
    )


def _gains_caption(result: Diagnosis) -> str:
    strain = any(with_strain(result, e.name) for e in result.entries)
    return (
        "How much of the difference each effect takes away at places that the fit had not seen"
        + (
            "; most were tried beside finite strain, which every soft solid has, and the hatched part of a "
            "bar is what that takes away by itself"
            if strain
            else ""
        )
        + "."
        + ("" if result.effects else " None of them is large and steady enough to be named.")
    )


def _next_touch(page: Page, result: Diagnosis) -> None:
    touch = result.next_touch
    if touch is None:
        return
    page.heading("To be sure: touch here next" if result.unsettled else "If you touch it once more")
    hangs = "" if result.unsettled else " Nothing hangs on it: the answer above stands without."
    if touch.kind != "press":
        page.paragraph(
            f"To tell {' from '.join(n.replace('_', ' ') for n in touch.separates)}: {touch.why}.{hangs}"
        )
        return
    x, y, z = (1e3 * v for v in (touch.x, touch.y, touch.z))
    direction = ", ".join(f"{d:.2f}" for d in touch.direction)
    hold = f", and hold for {touch.hold_s:.1f} s" if touch.hold_s > 0.05 else ""
    page.paragraph(
        f"To tell {' from '.join(n.replace('_', ' ') for n in touch.separates)}, press at ({x:.0f}, {y:.0f}, "
        f"{z:.0f}) mm in the direction ({direction}), {touch.depth_m * 1e3:.1f} mm deep at "
        f"{touch.speed_m_per_s * 1e3:.0f} mm/s{hold}: {touch.why}.{hangs}"
    )


def _modulus_after(page: Page, model: Model, result: Diagnosis) -> None:
    before, after = model.material.young_modulus_pa, result.young_modulus_pa
    low, high = model.material.young_modulus_ci95_pa
    known = np.isfinite([low, high]).all()
    page.paragraph(
        f"Young's modulus: {before / 1e3:.2f} kPa in the model"
        + (f" ({low / 1e3:.2f} to {high / 1e3:.2f} kPa, 95 %)" if known else "")
        + f", {after / 1e3:.2f} kPa fitted anew with what was found ({100 * (after / before - 1):+.1f} %)."
    )


def _how_large(page: Page, result: Diagnosis) -> None:
    rows = parameter_rows(result)
    if rows:
        page.heading("How large, and how sure")
        page.table(["effect", "quantity", "found", "95 % sure between", "unit"], rows)
    elif result.reasons:
        page.heading("Remarks")
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
    page.heading("The effects that were tried")
    page.paragraph(
        "Each effect was put into the simulation by itself, or beside finite strain (large deformations, "
        "which stretch and squeeze the material by more than a few per cent) where its name says so, fitted, "
        "and judged at places that the fit had not seen. Best first."
    )
    page.table(
        ["effect", "what it means", "how likely", "difference left [mN]", "taken away", "fitted values"],
        [
            [
                beside(result, e.name),
                meaning(e.name),
                percent(e.probability),
                f"{e.gap_after_n * 1e3:.0f}",
                share_words(e.gap_closed),
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


def _follows(page: Page, result: Diagnosis) -> None:
    page.heading("What the difference depends on")
    page.table(
        ["the difference depends on", "share of it", "probability that this is chance"],
        [[AXIS_WORDS[a.axis], percent(a.share), f"{a.p:.2g}"] for a in result.where.axes],
    )
    page.figure(curves_picture(result), "Mean difference at each depth, and at each speed of the tip.")
    page.figure(presses_picture(result), "The presses that differ most, after the first picture's.")


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
