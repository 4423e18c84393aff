"""The demo's report: what was touched, what was reconstructed, how its force compares, how the loop ran."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.demo import DemoResult
from palpate.diagnosis.verdict.result import Diagnosis
from palpate.reconstruction.steps.s6_one_d import low_passed
from palpate.render.surface.felt_surface import felt_surface
from palpate.servo.report import ServoReport
from palpate.show import model as made
from palpate.show.diagnosis.gaps import known
from palpate.show.diagnosis.words import force_words, spoken, verdict
from palpate.show.model import local, rms_by_press, usual_colourings, view_of_presses
from palpate.show.page import Page, file_words, subplots
from palpate.show.quantities import ERROR, UNCERTAINTY
from palpate.show.reconstruction.exploration import force_over_time
from palpate.show.scenery import Colours, draw_object, draw_touched
from palpate.show.view3d import Colouring, Line, View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pyvista import Plotter

__all__ = ["as_json", "draw", "lines", "next_steps", "place", "report", "view"]
_STAGES = {
    "reconstruct": "from the recording to the model",
    "precompute": "how every place gives",
    "replay": "the recorded path once more",
    "feel at 1 kHz": "a simulated hand at 1000 forces a second",
    "diagnose": "what the simplest simulation leaves out",
}
SHOWN_PRESSES = 3
_STEP_S = 0.05
"""Between samples of one press of a diagnosis; what is longer lies between presses."""


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


def press_figures(result: DemoResult) -> dict[str, Figure]:
    """Force along the normal over depth, measured and rendered, of presses spread over the peak force."""
    presses = result.model.presses
    shown = low_passed(presses)
    push = [shown.push[shown.rows([i])].max() for i in range(len(presses))]
    chosen = np.argsort(push)[np.linspace(0, len(push) - 1, SHOWN_PRESSES).round().astype(int)]
    curves, smooth = presses.window(0.03, 0.03), shown.window(0.03, 0.03)
    made = {}
    for i in chosen:
        made[f"press-{i + 1}"], ax = subplots(1, 1, figsize=(4.4, 3))
        own = curves.rows([i])
        depth, at = smooth.depth[own] * 1e3, np.searchsorted(result.recording.t, curves.t[own])
        rendered = result.rendered_n[at] @ presses.normal[i]
        ax.plot(depth, curves.push[own], ".", ms=1, color="#a8bccb", label="measured")
        ax.plot(depth, rendered, lw=1.5, color="#c1121f", label="rendered")
        ax.set(title=f"press {i + 1}", xlabel="depth [mm]", ylabel="force along the normal [N]")
        ax.set_ylim(top=1.05 * max(push))
        ax.legend(loc="upper left", frameon=False, markerscale=8)
    return made


def view(result: DemoResult) -> View:
    """The object; each press as measured, as rendered, and as the diagnosis's ideal simulation."""
    model, recording = result.model, result.recording
    shown = low_passed(model.presses).window(0.03, 0.03)
    at = np.searchsorted(recording.t, shown.t).clip(0, len(recording.t) - 1)
    off = result.rendered_n[at] - shown.force
    each = rms_by_press(shown, off)
    lines = [
        Line("measured", local(shown, shown.force), "measured"),
        Line("rendered", local(shown, result.rendered_n[at]), "rendered"),
        *_simulated(result, shown.t),
    ]
    error = Colouring(
        ERROR,
        None,
        each,
        "Rendered less measured, root mean square over each press; between presses what is near, "
        "paler where nobody touched.",
    )
    first, *others = usual_colourings(model)
    return view_of_presses(model, shown, [first, error, *others], lines, int(np.argmax(each)))


def _simulated(result: DemoResult, t: np.ndarray) -> list[Line]:
    """The diagnosis's own simulations at times t (n,) s: the ideal one, and with what was found."""
    found = result.diagnosis
    if (
        found is None
        or found.forward is None
        or found.residual_before is None
        or found.residual_after is None
    ):
        return []
    touches = found.forward.touches
    following = np.searchsorted(touches.t, t).clip(1, len(touches.t) - 1)
    between = touches.t[following] - touches.t[following - 1] > _STEP_S
    lines = []
    for name, residual, kind in (
        ("ideal simulation (linear, small strain)", found.residual_before, "effect"),
        ("simulation with what was found", found.residual_after, "found"),
    ):
        force = touches.local_force - residual
        seen = np.stack([np.interp(t, touches.t, axis, np.nan, np.nan) for axis in force.T], axis=1)
        lines.append(Line(name, np.where(between[:, None], np.nan, seen), kind, False))
    return lines if found.effects else lines[:1]


def figures(result: DemoResult) -> dict[str, Figure]:
    """The report's pictures by name."""
    force, ax = subplots(1, 1, figsize=(9, 3))
    force_over_time(ax, result.reconstruction.exploration)
    thing, axes = subplots(1, 2, figsize=(10, 4.2))
    draw_touched(axes[0], result.model)
    doubt = felt_surface(result.model).uncertainty_m
    draw_object(axes[1], result.model, Colours(doubt * UNCERTAINTY.scale, UNCERTAINTY))
    return {"force": force, "object": thing, **press_figures(result)}
