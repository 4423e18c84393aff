"""The demo's report: what was touched, what was reconstructed, how its force compares, how the loop ran."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from diagnose.verdict.result import Diagnosis
from palpate.demo import DemoResult
from palpate.servo.report import ServoReport
from palpate.show import model as made
from palpate.show.demo.figures import figures, view
from palpate.show.diagnosis.gaps import known
from palpate.show.diagnosis.words import force_words, spoken, verdict
from palpate.show.page import Page, file_words
from palpate.show.reconstruction.exploration import force_over_time

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

__all__ = ["as_json", "draw", "lines", "place", "report", "view"]


def lines(result: DemoResult) -> list[str]:
    """What `print` says, with units."""
    model = result.model
    return [
        f"Young's modulus {model.material.young_modulus_pa / 1e3:.2f} kPa from {len(model.presses)} presses",
        f"rendered against measured force: {result.replay_rmse_n:.3f} N rms of "
        f"{result.contact_force_rms_n:.3f} N rms",
        str(result.servo),
        *([f"diagnosis: {verdict(result.diagnosis)}"] if result.diagnosis else []),
    ]


def as_json(result: DemoResult) -> dict[str, Any]:
    """The figures of `palpate demo --json`."""
    material = result.model.material
    return {
        "young_modulus_pa": material.young_modulus_pa,
        "young_modulus_ci95_pa": material.young_modulus_ci95_pa,
        "replay_rmse_n": result.replay_rmse_n,
        "servo": result.servo.as_dict(),
        "seconds": result.seconds,
        "diagnosis": diagnosis_json(result.diagnosis),
    }


def diagnosis_json(diagnosis: Diagnosis | None) -> dict[str, Any] | None:
    """The diagnosis's answer, by the keys of `palpate diagnose --json`; None where none was made."""
    if diagnosis is None:
        return None
    whole = diagnosis.as_json()
    return {key: whole[key] for key in ("verdict", "noise_n", "gap_before_n", "gap_after_n", "gap_closed")}


def draw(result: DemoResult, ax: Axes) -> None:
    """Force over time with the touches that were found."""
    force_over_time(ax, result.reconstruction.exploration)


def place(result: DemoResult, plotter: Plotter) -> None:
    """The model."""
    made.place(result.model, plotter)


def report(result: DemoResult, path: Path | str) -> Path:
    """Write the page, and its pictures as PNGs beside it; returns the page's path."""
    path = Path(path)
    folder = path.parent
    model, servo = result.model, result.servo
    low, high = (v / 1e3 for v in model.material.young_modulus_ci95_pa)
    page = Page(f"Palpate: {result.recording.object_name}, touched and felt")
    page.lead(
        f"{len(model.presses)} presses became a model that feels like the object: it is typically "
        f"{force_words(result.replay_rmse_n)} off, in touches of {force_words(result.contact_force_rms_n)}."
    )
    page.paragraph(
        f"{_meaning(result)} The object's stiffness: a Young's modulus of "
        f"{model.material.young_modulus_pa / 1e3:.1f} kPa (95 % sure: {low:.1f} to {high:.1f} kPa"
        f"{_truth(result)}). A hand would have felt it at {servo.rate_hz:.0f} forces a second"
        f"{_missed(servo)}."
    )
    page.next_step(
        "What to do next: feel it: `palpate touch "
        f"{file_words(model.path or folder / 'model', 'MODEL')}`; then bring in your own recording: "
        "`palpate open FILE`."
    )
    drawn = figures(result)
    saved = page.save(folder, drawn)
    page.view(
        view(result),
        saved["object"],
        "Left: where the object was touched, and its glued base. Right: how uncertain its shape is.",
        result.model,
    )
    page.heading("Measured beside rendered")
    page.figure(drawn["presses"], "Four presses, from the softest to the hardest, measured and rendered.")
    if result.diagnosis is not None:
        page.heading("What a simpler simulation would leave out")
        page.paragraph(diagnosis_words(result))
    page.heading("What the hand did")
    page.figure(
        drawn["force"], "Force over time: first the base is traced (phase I), then the object is pressed."
    )
    page.heading("How it was made")
    surface = result.reconstruction.surface
    page.paragraph(f"Shape: {surface.method}, {surface.reason}.")
    page.paragraph(
        f"The loop of 1000 forces a second: {str(servo).replace(chr(10), '; ')}. {sent_words(servo)}"
    )
    page.table(["stage", "time [s]"], [[name, round(s, 1)] for name, s in result.seconds.items()])
    page.result(as_json(result))
    return page.write(path)


def _missed(servo: ServoReport) -> str:
    missed = servo.missed_ticks
    return f", {missed} of which came late" if missed else ", none of them late"


def _meaning(result: DemoResult) -> str:
    noise = result.reconstruction.exploration.noise_n * np.sqrt(3.0)
    ratio = result.replay_rmse_n / noise
    compared = "as small as" if ratio < 1.1 else f"{ratio:.1f} times"
    return f"That difference is {compared} the sensor's own noise ({1e3 * noise:.0f} mN)."


def diagnosis_words(result: DemoResult) -> str:
    """What the diagnosis found, and which of the two simulations it is about."""
    found, law = result.diagnosis, result.model.material.dent_law
    assert found is not None
    there = {known()} if law != "linear" else set()
    words = (
        "The simplest simulation, of small deformations and one stiffness, is "
        f"{1e3 * found.gap_before_n:.0f} mN off at places that it was not fitted to"
    )
    if found.effects:
        words += f"; with {spoken(found.effects)} it is {1e3 * found.gap_after_n:.0f} mN off"
    words += f". The sensor's noise is {1e3 * found.noise_n:.0f} mN."
    has = [name for name in found.effects if name in there]
    if has:
        words += f" The model that you feel has {spoken(has)} already: its {law} law stands for it."
    rest = [name for name in found.effects if name not in there]
    if rest:
        words += f" It does not have {spoken(rest)}: what to do about that stands in the page of "
        words += f"`palpate diagnose {file_words(result.recording.path, 'REC')} --report PAGE.html`."
    if found.candidates:
        words += f" These touches cannot rule out {spoken(found.candidates, 'or')}."
    return words


def sent_words(servo: ServoReport) -> str:
    """Why the device was sent another greatest force than was rendered, '' where it was not."""
    more = servo.peak_force_n - servo.peak_rendered_n
    if abs(more) < 0.01:
        return ""
    if more > 0:
        return (
            f"The {more:.2f} N more that were sent than rendered are damping: where a held sample would give "
            "the hand energy back, the passivity controller resists the motion. It took "
            f"{1e3 * servo.energy_damped_j:.1f} mJ in all."
        )
    return f"The {-more:.2f} N less that were sent than rendered were held back by the safety filter."


def _truth(result: DemoResult) -> str:
    truth = (result.recording.truth or {}).get("young_modulus_pa")
    return f"; the truth is {truth / 1e3:.1f} kPa" if truth else ""
