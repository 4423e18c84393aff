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

__all__ = ["as_json", "draw", "lines", "next_steps", "place", "report", "view"]


def lines(result: DemoResult) -> list[str]:
    """What `print` says, with units."""
    model = result.model
    return [
        f"{len(model.presses)} presses became a model of {model.material.young_modulus_pa / 1e3:.2f} kPa "
        "(Young's modulus)",
        f"its force is typically {force_words(result.replay_rmse_n)} off, in touches of "
        f"{force_words(result.contact_force_rms_n)}",
        f"a hand would have felt it at {result.servo.rate_hz:.0f} forces a second: of "
        f"{result.servo.ticks + result.servo.missed_ticks} {result.servo.missed_ticks} were skipped, "
        f"{result.servo.late_ticks} came late",
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
    page.next_steps(next_steps(result))
    drawn = figures(result)
    saved = page.save(folder, drawn)
    page.view(
        view(result),
        saved["object"],
        "Left: where the object was touched, and its glued base. Right: how uncertain its shape is.",
        result.model,
    )
    page.heading("Measured beside rendered")
    page.paragraph("Three presses, from the lightest to the hardest.")
    page.figures(
        [(drawn[name], f"{name.replace('-', ' ').capitalize()}.") for name in drawn if "press-" in name]
    )
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
    page.table(["the loop of 1000 forces a second", "against a simulated hand"], _loop(servo))
    if words := sent_words(servo):
        page.paragraph(words)
    page.table(
        ["step", "time [s]"], [[_STAGES.get(name, name), f"{s:.1f}"] for name, s in result.seconds.items()]
    )
    page.result(as_json(result))
    return page.write(path)


def next_steps(result: DemoResult) -> list[str]:
    """What to do after the demo."""
    model = file_words(result.model.path, "MODEL")
    return [f"feel it: `palpate touch {model}`", "bring in your own recording: `palpate open FILE`"]


def _missed(servo: ServoReport) -> str:
    missed = servo.missed_ticks
    return f"; of {servo.ticks + missed} {missed} were skipped" if missed else ", and none was skipped"


_STAGES = {
    "reconstruct": "from the recording to the model",
    "precompute": "how every place gives",
    "replay": "the recorded path once more",
    "feel at 1 kHz": "a simulated hand at 1000 forces a second",
    "diagnose": "what the simplest simulation leaves out",
}


def _loop(servo: ServoReport) -> list[list[str]]:
    """What the loop did, in words."""
    compute = servo.compute.summary()
    return [
        ["forces given", f"{servo.ticks} in {servo.seconds:.1f} s"],
        ["skipped, since the machine was busy", str(servo.missed_ticks)],
        ["given late", str(servo.late_ticks)],
        ["to compute one force", f"{compute['median']:.0f} µs; 999 of 1000 within {compute['p99.9']:.0f} µs"],
        ["in contact", f"{100 * servo.contact_share:.0f} % of the time"],
        ["greatest force", f"{servo.peak_rendered_n:.2f} N rendered, {servo.peak_force_n:.2f} N sent"],
        ["energy given to the hand", f"{1e3 * servo.energy_given_back_j:.3f} mJ at most"],
    ]


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
