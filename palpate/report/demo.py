"""The demo's report: what was touched, what was reconstructed, how its force compares, how the loop ran."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from palpate.demo import DemoResult
from palpate.report.exploration_figures import force_over_time
from palpate.report.object3d import draw_object
from palpate.report.page import Page, save_figures
from palpate.servo.histogram import lower_edge_ns
from reconstruct.uniaxial import low_passed
from render.felt import felt_surface

SHOWN_PRESSES = 4


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


def servo_histogram(axes: np.ndarray, result: DemoResult) -> np.ndarray:
    """Compute time and lateness of every tick, logarithmic counts."""
    for ax, histogram, name in (
        (axes[0], result.servo.compute, "compute time of a tick [us]"),
        (axes[1], result.servo.lateness, "start after the deadline [us]"),
    ):
        lower_us = np.array([lower_edge_ns(i) for i in range(len(histogram.counts) + 1)]) / 1e3
        most = max(histogram.greatest_ns / 1e3, 1.0)
        edges = np.linspace(0, most * 1.05, 61)
        counts, _ = np.histogram(lower_us[:-1], edges, weights=histogram.counts)
        ax.stairs(counts, edges, fill=True, color="#457b9d")
        ax.set(xlabel=name, ylabel="ticks", yscale="log", xlim=(0, edges[-1]))
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
    draw_object(axes[1], model, values=doubt * 1e3, label="shape uncertainty [mm]")
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
        f"(95 % interval {low:.1f} to {high:.1f} kPa{_truth(result)}). Its rendered force differs from the "
        f"measured one by {result.replay_rmse_n:.3f} N rms, of {result.contact_force_rms_n:.2f} N rms, and "
        f"the loop held {servo.rate_hz:.0f} Hz."
    )
    drawn = figures(result)
    saved = save_figures(folder, drawn)
    for figure in drawn.values():
        plt.close(figure)
    page.heading("What the hand did")
    page.figure(saved["force"], "Force over time: the base is traced in phase I; circles are first touches.")
    page.heading("The object")
    page.paragraph(f"Surface: {result.reconstruction.surface.method}. {result.reconstruction.surface.reason}")
    page.figure(saved["object"], "Left: contact points and fixed base. Right: how uncertain the shape is.")
    page.heading("Measured against rendered")
    page.figure(
        saved["presses"], "Four presses, from the softest to the hardest, replayed through the renderer."
    )
    if result.diagnosis is not None:
        page.heading("Why they differ")
        page.paragraph(result.diagnosis.summary)
    page.heading("The 1 kHz loop")
    page.paragraph(str(servo).replace("\n", "; "))
    page.figure(saved["servo"], "Every tick of the servo process against the simulated hand.")
    page.heading("Time")
    page.table(["stage", "seconds"], [[name, round(s, 1)] for name, s in result.seconds.items()])
    return page.write(folder / "report.html")


def _truth(result: DemoResult) -> str:
    truth = (result.recording.truth or {}).get("young_modulus_pa")
    return f"; the truth is {truth / 1e3:.1f} kPa" if truth else ""
