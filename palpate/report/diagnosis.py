"""The report of a diagnosis: the three answers on the first screen, with pictures, then the evidence."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from diagnose.apply import improved
from diagnose.result import Diagnosis
from mechanics.model import Model
from mechanics.recording import Recording
from palpate.report.diagnosis_figures import (
    curves_picture,
    first_picture,
    gap_of,
    modulus_picture,
    presses_picture,
)
from palpate.report.diagnosis_words import (
    AXIS_WORDS,
    ERROR_WORDS,
    answers,
    force_words,
    meaning,
    parameter_rows,
    share_words,
    short,
    spoken,
    verdict,
)
from palpate.report.page import Page

MOST_EFFECTS = 8


def write_report(path: Path | str, recording: Recording, model: Model, result: Diagnosis) -> Path:
    """Write one self-contained HTML page; returns its path."""
    t, _, _ = gap_of(result)
    typical = float(np.sqrt((t.local_force[t.counted] ** 2).sum(axis=1).mean()))
    page = Page(f"Simulated touch against measured touch: {recording.name}")
    page.lead(verdict(result))
    page.cards(answers(result, typical))
    page.figure(first_picture(model, result), _caption(result))
    _next_touch(page, result)
    _how_large(page, result)
    _moduli(page, model, result)
    _tried(page, result)
    _follows(page, result)
    _own_errors(page, result)
    return page.write(path)


def _caption(result: Diagnosis) -> str:
    after = ", with what was found (dashed)" if result.effects else ""
    return (
        "Left: how far the simulated force is from the measured one around each place that was touched, in "
        "millinewtons (1 mN: the weight of a tenth of a gram). Middle: measured and simulated force of one "
        f"press{after}. Right: how much of the difference each effect alone would take away at places that "
        "the fit had not seen."
        + ("" if result.effects else " None of them is large and steady enough to be named.")
    )


def _next_touch(page: Page, result: Diagnosis) -> None:
    touch = result.next_touch
    if touch is None or not result.candidates:
        return
    page.heading("To be sure: touch here next")
    x, y, z = (1e3 * v for v in (touch.x, touch.y, touch.z))
    direction = ", ".join(f"{d:.2f}" for d in touch.direction)
    hold = f", and hold for {touch.hold_s:.1f} s" if touch.hold_s > 0.05 else ""
    page.paragraph(
        f"To tell {' from '.join(n.replace('_', ' ') for n in touch.separates)}, press at ({x:.0f}, {y:.0f}, "
        f"{z:.0f}) mm in the direction ({direction}), {touch.depth_m * 1e3:.1f} mm deep at "
        f"{touch.speed_m_per_s * 1e3:.0f} mm/s{hold}: {touch.why}."
    )


def _how_large(page: Page, result: Diagnosis) -> None:
    rows = parameter_rows(result)
    if rows:
        page.heading("How large, and how sure")
        page.table(["effect", "quantity", "found", "95% sure between", "unit"], rows)
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
        "Each effect was put into the simulation alone (beside finite strain where that fits better: large "
        "deformations, which stretch and squeeze the material by more than a few per cent), fitted, and "
        "judged at places that the fit had not seen. Best first."
    )
    page.table(
        ["effect", "what it means", "how likely", "difference left (mN)", "taken away", "fitted values"],
        [
            [
                e.name.replace("_", " "),
                meaning(e.name),
                f"{e.probability:.0%}",
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
        page.paragraph(f"The fast setting did not try: {spoken(result.left_out)}.")


def _follows(page: Page, result: Diagnosis) -> None:
    page.heading("What the difference depends on")
    page.table(
        ["the difference depends on", "share of it", "probability that this is chance"],
        [[AXIS_WORDS[a.axis], f"{a.share:.0%}", f"{a.p:.2g}"] for a in result.where.axes],
    )
    page.figure(curves_picture(result), "Mean difference at each depth, and at each speed of the tip.")
    page.figure(presses_picture(result), "The presses that differ most, after the first picture's.")


def _own_errors(page: Page, result: Diagnosis) -> None:
    page.heading("Our own errors")
    page.paragraph(
        "What the comparison itself gets wrong, as a typical (root mean square) force during touch. A "
        "difference below these is no evidence of anything."
    )
    page.table(["source", "mN"], [[ERROR_WORDS[k], f"{v * 1e3:.1f}"] for k, v in result.errors_n.items()])
