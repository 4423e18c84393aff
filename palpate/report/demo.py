"""The demo's report: what was touched, what was reconstructed, how its force compares, how the loop ran."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from palpate.demo import DemoResult
from palpate.report.diagnosis_figures import known
from palpate.report.exploration_figures import force_over_time
from palpate.report.object3d import draw_object
from palpate.report.page import Page, save_figures
from palpate.report.quantities import ERROR, UNCERTAINTY
from palpate.report.view3d import Colouring, Line, View, facing, local, thing_of, traces_of, usual_colourings
from palpate.servo.histogram import lower_edge_ns
from palpate.servo.report import ServoReport
from reconstruct.steps.s6_one_d.one_d import low_passed
from render.felt import felt_surface

SHOWN_PRESSES = 4
_STEP_S = 0.05
"""Between samples of one press of a diagnosis; what is longer lies between presses."""


def measured_against_rendered(axes: np.ndarray, result: DemoResult) -> np.ndarray:
    """Force along the normal over depth, measured and rendered, of presses spread over the peak force."""
    presses = result.model.presses
    shown = low_passed(presses)
    push = [shown.push[shown.rows([i])].max() for i in range(len(presses))]
    chosen = np.argsort(push)[np.linspace(0, len(push) - 1, len(axes)).round().astype(int)]
    curves, smooth = presses.window(0.03, 0.03), shown.window(0.03, 0.03)
    for ax, i in zip(axes, chosen, strict=True):
        own = curves.rows([i])
        depth, at = smooth.depth[own] * 1e3, np.searchsorted(result.recording.t, curves.t[own])
        rendered = result.rendered_n[at] @ presses.normal[i]
        ax.plot(depth, curves.push[own], ".", ms=1, color="#a8bccb", label="measured")
        ax.plot(depth, rendered, lw=1.5, color="#c1121f", label="rendered")
        ax.set(title=f"press {i + 1}", xlabel="depth [mm]")
    axes[0].set_ylabel("force along the normal [N]")
    axes[0].legend(loc="upper left", frameon=False, markerscale=8)
    return axes


def view_of(result: DemoResult) -> View:
    """The object; each press as measured, as rendered, and as the diagnosis's ideal simulation."""
    model, recording = result.model, result.recording
    shown = low_passed(model.presses).window(0.03, 0.03)
    at = np.searchsorted(recording.t, shown.t).clip(0, len(recording.t) - 1)
    off = result.rendered_n[at] - shown.force
    each = np.array([np.sqrt((off[part] ** 2).sum(axis=1).mean()) for part in shown.parts])
    lines = [
        Line("measured", local(shown, shown.force), "measured"),
        Line("rendered", local(shown, result.rendered_n[at]), "rendered"),
        *_simulated(result, shown.t),
    ]
    error = Colouring(
        ERROR,
        None,
        each,
        "Rendered less measured, root mean square over each press; between presses what is near.",
    )
    first, *others = usual_colourings(model)
    worst = int(np.argmax(each))
    return View(
        thing_of(model),
        model.presses.point,
        [first, error, *others],
        traces_of(shown, lines),
        worst,
        facing(model.support.normal, model.presses.normal[worst]),
    )


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


def servo_histogram(axes: np.ndarray, result: DemoResult) -> np.ndarray:
    """Compute time and lateness of every tick, logarithmic counts."""
    for ax, histogram, name in (
        (axes[0], result.servo.compute, "compute time of a tick [µs]"),
        (axes[1], result.servo.lateness, "start after the deadline [µs]"),
    ):
        lower_us = np.array([lower_edge_ns(i) for i in range(len(histogram.counts) + 1)]) / 1e3
        used = np.flatnonzero(histogram.counts)
        least = max(lower_us[used[0]], 0.1) if len(used) else 0.1
        edges = np.geomspace(least, max(histogram.greatest_ns / 1e3, 2 * least) * 1.05, 41)
        counts, _ = np.histogram(lower_us[:-1].clip(least), edges, weights=histogram.counts)
        ax.stairs(counts, edges, fill=True, color="#457b9d")
        ax.set(xlabel=name, ylabel="ticks", yscale="log", xscale="log", xlim=(edges[0], edges[-1]))
        wide = edges[-1] > 300 * edges[0]
        ax.xaxis.set_major_locator(LogLocator(subs=(1.0,) if wide else (1.0, 2.0, 5.0)))
        ax.xaxis.set_major_formatter("{x:g}")
        ax.xaxis.set_minor_formatter(NullFormatter())
    return axes


def figures(result: DemoResult) -> dict[str, Figure]:
    """The report's pictures by name."""
    force, ax = plt.subplots(figsize=(9, 3), layout="constrained")
    force_over_time(ax, result.reconstruction.exploration)
    thing, axes = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
    model = result.model
    touches = model.presses.point
    draw_object(axes[0], model, touches=touches, show_base=True)
    axes[0].legend(loc="upper center", frameon=False, bbox_to_anchor=(0.5, 0.0), ncols=2)
    doubt = felt_surface(model).uncertainty_m
    draw_object(
        axes[1], model, values=doubt * UNCERTAINTY.scale, label=UNCERTAINTY.label,
        colour_map=UNCERTAINTY.colour_map,
    )  # fmt: skip
    presses, axes = plt.subplots(1, SHOWN_PRESSES, figsize=(12, 3), sharey=True, layout="constrained")
    measured_against_rendered(axes, result)
    loop, axes = plt.subplots(1, 2, figsize=(9, 2.6), layout="constrained")
    servo_histogram(axes, result)
    return {"force": force, "object": thing, "presses": presses, "servo": loop}


def write_report(result: DemoResult, folder: Path) -> Path:
    """Write `folder/report.html` and its pictures as PNGs; returns the report's path."""
    model, servo = result.model, result.servo
    low, high = (v / 1e3 for v in model.material.young_modulus_ci95_pa)
    page = Page(f"Palpate: {result.recording.object_name}, touched and felt")
    page.lead(
        f"{len(model.presses)} presses became a model of {model.material.young_modulus_pa / 1e3:.1f} kPa "
        f"(95 % interval {low:.1f} to {high:.1f} kPa{_truth(result)}) that feels like the object to "
        f"{1e3 * result.replay_rmse_n:.0f} mN, of {1e3 * result.contact_force_rms_n:.0f} mN in a touch."
    )
    page.paragraph(
        f"{_meaning(result)} The loop that a hand would feel held {servo.rate_hz:.0f} Hz with "
        f"{servo.missed_ticks} ticks missed."
    )
    page.next_step(f"What to do next: feel it: `palpate touch {model.path or folder / 'model'}`.")
    drawn = figures(result)
    saved = save_figures(folder, drawn)
    for figure in drawn.values():
        plt.close(figure)
    page.view(
        view_of(result),
        saved["object"],
        "Left: contact points and fixed base. Right: how uncertain the shape is.",
    )
    page.paragraph(
        f"Surface: {result.reconstruction.surface.method}; {result.reconstruction.surface.reason}."
    )
    page.heading("What the hand did")
    page.figure(saved["force"], "Force over time: the base is traced in phase I; circles are first touches.")
    page.heading("Measured against rendered")
    page.figure(
        saved["presses"], "Four presses, from the softest to the hardest, replayed through the renderer."
    )
    if result.diagnosis is not None:
        page.heading("What a simpler simulation would leave out")
        page.paragraph(diagnosis_words(result))
    page.heading("The 1 kHz loop")
    page.paragraph(f"{str(servo).replace(chr(10), '; ')}. {sent_words(servo)}".strip())
    page.figure(saved["servo"], "Every tick of the servo process against the simulated hand.")
    page.heading("Time")
    page.table(["stage", "time [s]"], [[name, round(s, 1)] for name, s in result.seconds.items()])
    return page.write(folder / "report.html")


def _meaning(result: DemoResult) -> str:
    noise = result.reconstruction.exploration.noise_n * np.sqrt(3.0)
    ratio = result.replay_rmse_n / noise
    compared = "as small as" if ratio < 1.1 else f"{ratio:.1f} times"
    return f"That difference is {compared} the sensor's own noise ({1e3 * noise:.0f} mN)."


def diagnosis_words(result: DemoResult) -> str:
    """What the diagnosis found, and which of the two simulations it is about."""
    found, law = result.diagnosis, result.model.material.dent_law
    assert found is not None
    deep = law != "linear"
    words = (
        "Two simulations are compared with the hand here. The renderer, whose curves stand above, uses the "
        "dent "
        f"law that the presses fit best ({law}). The diagnosis starts from the simplest one, linear and "
        "for small "
        f"strain, and asks what that leaves out: {found.summary}. At places that it was not fitted to, the "
        f"simplest simulation is {1e3 * found.gap_before_n:.0f} mN off"
    )
    if found.effects:
        words += f", with what was found {1e3 * found.gap_after_n:.0f} mN"
    words += f"; the sensor's noise is {1e3 * found.noise_n:.0f} mN."
    if deep and known() in found.effects:
        words += " Finite strain is in the rendered curves already: that is what the law stands for."
    rest = [name.replace("_", " ") for name in found.effects if not (deep and name == known())]
    if rest:
        words += f" The rendered curves do not have {' and '.join(rest)}: what to do about that stands in "
        words += f"the page of `palpate diagnose {result.recording.path or 'REC'} --report PAGE.html`."
    return words


def sent_words(servo: ServoReport) -> str:
    """Why the device was sent another greatest force than was rendered, '' where it was not."""
    more = servo.peak_force_n - servo.peak_rendered_n
    if abs(more) < 0.01:
        return ""
    if more > 0:
        return (
            f"The {more:.2f} N more that were sent than rendered are damping: where a held sample would "
            "give the "
            "hand energy back, the passivity controller resists the motion. It took "
            f"{1e3 * servo.energy_damped_j:.1f} mJ in all."
        )
    return f"The {-more:.2f} N less that were sent than rendered were held back by the safety filter."


def _truth(result: DemoResult) -> str:
    truth = (result.recording.truth or {}).get("young_modulus_pa")
    return f"; the truth is {truth / 1e3:.1f} kPa" if truth else ""
