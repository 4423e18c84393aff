"""The report of a diagnosis: the three answers on the first screen, with pictures, then the evidence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from diagnose.library import effect
from diagnose.result import Diagnosis
from mechanics.model import Model
from mechanics.recording import Recording
from palpate.report.object3d import draw_object
from palpate.report.page import Page

AXIS_WORDS = {
    "depth": "how deep the press is",
    "rate": "how fast the press is",
    "phase": "loading, holding or unloading",
    "direction": "sideways against straight",
    "space": "the place on the object",
    "order": "the order in time",
    "repeat": "first touch or repeat",
    "free_air": "free air, nothing touched",
}


ERROR_WORDS = {
    "sensor": "noise of the force sensor",
    "repeatability": "repeats at one place",
    "shape": "shape where nobody touched",
    "model": "everything that the final model leaves",
}


def write_report(path: Path | str, recording: Recording, model: Model, result: Diagnosis) -> Path:
    """Write one self-contained HTML page; returns its path."""
    page = Page(f"Where simulation and reality part: {recording.name}")
    page.lead(result.summary[0].upper() + result.summary[1:] + ".")
    page.paragraph(f"Where: {_where(result)}")
    page.paragraph(f"Which: {_which(result)}")
    page.paragraph(f"How far: {_how_far(result)}")
    page.figure(first_picture(model, result), _caption(result))
    page.heading("The effects that were tried")
    page.paragraph(
        "Each effect was added alone to the model (with finite strain in it where that fits better) and the "
        "gap measured on places that the fit had not seen. Best first."
    )
    page.table(
        ["effect", "what it means", "probability", "gap left (mN)", "share closed", "parameters"],
        [
            [
                e.name.replace("_", " "),
                effect(e.name).words,
                f"{e.probability:.2f}",
                f"{e.gap_after_n * 1e3:.0f}",
                _share(e.gap_closed),
                _short(e.parameters) if e.probability > 0.01 else "",
            ]
            for e in result.entries[:8]
        ],
    )
    if rows := _parameter_rows(result):
        page.heading("How large, and how sure")
        page.table(["effect", "quantity", "found", "95 % interval", "unit"], rows)
    for reason in result.reasons:
        page.paragraph(reason[0].upper() + reason[1:] + ".")
    if result.held_out_n:
        page.paragraph(
            "Held out on purpose: "
            + "; ".join(
                f"at the places of the {k} presses the gap goes from {a * 1e3:.0f} to {b * 1e3:.0f} mN"
                for k, (a, b) in result.held_out_n.items()
            )
            + "."
        )
    page.heading("What the gap follows")
    page.table(
        ["the gap follows", "share of it", "chance (family-wise p)"],
        [[AXIS_WORDS[a.axis], f"{a.share:.0%}", f"{a.p:.2g}"] for a in result.where.axes],
    )
    page.figure(
        presses_picture(result),
        "The presses with the largest gap: measured, ideal model, model with the effect.",
    )
    page.heading("Our own errors")
    page.paragraph(
        "What the comparison itself gets wrong, as rms force over the contact samples. A gap below these is "
        "no evidence of anything."
    )
    page.table(["source", "mN rms"], [[ERROR_WORDS[k], f"{v * 1e3:.1f}"] for k, v in result.errors_n.items()])
    if result.next_touch is not None:
        touch = result.next_touch
        page.heading("The touch that would tell most")
        page.paragraph(
            f"To tell {' from '.join(n.replace('_', ' ') for n in touch.separates)}: press at "
            f"({touch.x * 1e3:.0f}, {touch.y * 1e3:.0f}, {touch.z * 1e3:.0f}) mm along "
            f"({', '.join(f'{d:.2f}' for d in touch.direction)}), {touch.depth_m * 1e3:.1f} mm deep at "
            f"{touch.speed_m_per_s * 1e3:.0f} mm/s, and hold {touch.hold_s:.1f} s: {touch.why}."
        )
    if result.confusable:
        page.paragraph(
            "On these touches the following look alike: "
            + "; ".join(
                f"{a.replace('_', ' ')} and {b.replace('_', ' ')}" for a, b, _ in result.confusable[:6]
            )
            + "."
        )
    if result.left_out:
        page.paragraph(
            f"The fast setting left out: {', '.join(n.replace('_', ' ') for n in result.left_out)}."
        )
    return page.write(path)


def _where(result: Diagnosis) -> str:
    axis = result.where.leading
    x, y, z, rms = result.where.worst[0]
    return (
        f"the gap follows {AXIS_WORDS[axis.axis]} most ({axis.share:.0%} of it). It is largest at "
        f"({x * 1e3:.0f}, {y * 1e3:.0f}, {z * 1e3:.0f}) mm: {rms * 1e3:.0f} mN there."
    )


def _which(result: Diagnosis) -> str:
    if not result.effects:
        words = "no effect. " + (
            "What is left is no larger than noise, first touch and shape explain."
            if result.kind == "none"
            else "There is a gap, but nothing that this program knows explains it."
        )
        return words
    parts = []
    parameters = {e.name: e.parameters for e in result.entries}
    for name in result.effects:
        keys = _short(parameters.get(name, {}))
        parts.append(f"{name.replace('_', ' ')} ({effect(name).words}{'; ' + keys if keys else ''})")
    words = "; ".join(parts) + "."
    if result.candidates:
        also = ", ".join(n.replace("_", " ") for n in result.candidates)
        words += f" These touches cannot rule out: {also}."
    if "unknown" in result.kind:
        words += " Something that this program does not know remains."
    return words


def _how_far(result: Diagnosis) -> str:
    text = (
        f"the ideal model (modulus refitted) misses the measured force by {result.gap_before_n * 1e3:.0f} mN "
        f"rms on places that it was not fitted to; the sensor's noise is {result.noise_n * 1e3:.0f} mN."
    )
    if result.effects and result.gap_closed is not None and result.gap_closed_ci95 is not None:
        low, high = result.gap_closed_ci95
        text += (
            f" With what was found it misses by {result.gap_after_n * 1e3:.0f} mN: {result.gap_closed:.0%} "
            f"of what exceeds the noise is closed (95 % interval {low:.0%} to {high:.0%})."
        )
    return text


def _share(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.0%}" if value >= 0 else "none (worse)"


def _caption(result: Diagnosis) -> str:
    axis = result.where.leading
    return (
        "Left: the gap at each place that was pressed. Middle: the mean gap along depth and along speed "
        f"(pressing positive, leaving negative); it follows {AXIS_WORDS[axis.axis]} most. Right: how much of "
        "the gap each effect alone closes."
    )


def first_picture(model: Model, result: Diagnosis) -> Any:
    """Where, how it runs, and what closes it: three panels."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 4.2), layout="constrained")
    left, middle, right = figure.subplots(1, 3, width_ratios=[1.25, 1, 1])
    _object(left, model, result)
    d, mean, error = result.where.curves["depth (mm)"]
    middle.errorbar(d, mean * 1e3, error * 1e3, marker="o", color="#1d3557", label="along depth (lower axis)")
    middle.axhline(0, color="#999999", lw=0.8)
    middle.set(xlabel="depth (mm)", ylabel="measured - ideal (mN)", title="the gap along depth and speed")
    upper = middle.twiny()
    v, mean, error = result.where.curves["speed of pressing (mm/s)"]
    upper.errorbar(v, mean * 1e3, error * 1e3, marker="s", color="#e76f51", label="along speed (upper axis)")
    upper.set_xlabel("speed of pressing (mm/s)", color="#e76f51")
    handles = [ax.get_legend_handles_labels() for ax in (middle, upper)]
    middle.legend(
        *(a + b for a, b in zip(*handles, strict=True)), fontsize=8, frameon=False, loc="lower right"
    )
    entries = [e for e in result.entries if e.gap_closed is not None][:7]
    colours = ["#2a9d8f" if e.name in result.effects else "#c9c9c9" for e in entries]
    values = [float(np.clip(e.gap_closed or 0.0, -0.5, 1.0)) for e in entries]
    right.barh([e.name.replace("_", " ") for e in entries], values, color=colours)
    right.invert_yaxis()
    right.axvline(0, color="#999999", lw=0.8)
    right.set(xlabel="share of the gap closed on unseen places", title="each effect alone (green: named)")
    return figure


def _object(ax: Any, model: Model, result: Diagnosis) -> None:
    forward = result.forward
    assert forward is not None
    t = forward.touches
    places = np.array([t.point[t.site == s].mean(axis=0) for s in range(t.sites)])
    nodes = model.mesh.points
    distance = np.linalg.norm(nodes[:, None] - places[None], axis=2)
    weight = np.exp(-((distance / 0.015) ** 2)) + 1e-9
    values = (weight @ (result.where.site_rmse * 1e3)) / weight.sum(axis=1)
    draw_object(ax, model, values, label="gap (mN rms)", colour_map="magma", touches=places)
    ax.set_title("the gap on the object (dots: places pressed)")


def presses_picture(result: Diagnosis, count: int = 4) -> Any:
    """Force against time of the presses with the largest gap."""
    from matplotlib.figure import Figure

    forward = result.forward
    assert forward is not None and result.residual_before is not None and result.residual_after is not None
    t = forward.touches
    each = np.bincount(
        t.press, weights=(result.residual_before**2).sum(axis=1) * t.counted, minlength=t.presses
    )
    figure = Figure(figsize=(13, 3.2), layout="constrained")
    for ax, press in zip(figure.subplots(1, count), np.argsort(-each)[:count], strict=True):
        rows = (t.press == press) & t.counted
        clock = t.t[rows] - t.onset_s[press]
        force = t.f[rows, 0]
        ax.plot(clock, force, color="#1d3557", lw=1.6, label="measured")
        ax.plot(clock, force - result.residual_before[rows, 0], color="#e76f51", lw=1, label="ideal model")
        if result.effects:
            ax.plot(
                clock, force - result.residual_after[rows, 0], color="#2a9d8f", lw=1, label="with the effect"
            )
        ax.set(xlabel="s", ylabel="normal force (N)")
    figure.axes[0].legend(fontsize=8, frameon=False)
    return figure


UNITS = (
    ("_n_per_m", 1.0, "N/m"),
    ("_n_per_s", 1e3, "mN/s"),
    ("_pa_per_m", 1e-6, "MPa/m"),
    ("_kg", 1e3, "g"),
    ("_rad", 180 / np.pi, "degrees"),
    ("_m", 1e3, "mm"),
    ("_s", 1e3, "ms"),
    ("_n", 1e3, "mN"),
)
WORDS = {
    "mu": "friction coefficient",
    "g": "extra force when fast, shares",
    "tau_s": "fading with time constants of",
    "c20_over_c10": "stiffening (c20/c10)",
    "r": "softening (r)",
    "m_rel": "softening (m)",
    "matrix": "gain matrix",
}


def _plain(key: str) -> tuple[str, float, str]:
    """(words, factor from SI, unit) of a parameter's key, in units that a hand knows."""
    suffix, factor, unit = next((u for u in UNITS if key.endswith(u[0])), ("", 1.0, ""))
    return WORDS.get(key, key.removesuffix(suffix).replace("_", " ")), factor, unit


def _number(value: Any, factor: float = 1.0) -> str:
    if isinstance(value, list) and len(value) == 1:
        return _number(value[0], factor)
    if isinstance(value, list):
        return "(" + ", ".join(_number(v, factor) for v in value) + ")"
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value)
    return f"{value * factor:.3g}"


def _short(parameters: dict[str, Any]) -> str:
    said = []
    for key, value in parameters.items():
        words, factor, unit = _plain(key)
        said.append(f"{words} {_number(value, factor)} {unit}".strip())
    return ", ".join(said)


def _parameter_rows(result: Diagnosis) -> list[list[str]]:
    """Effect, parameter, value, 95 % interval and unit of what was named."""
    rows = []
    for entry in result.entries:
        for key, value in entry.parameters.items() if entry.name in result.effects else ():
            words, factor, unit = _plain(key)
            low, high = entry.intervals.get(key, (None, None))
            span = "-" if low is None else f"{_number(low, factor)} to {_number(high, factor)}"
            rows.append([entry.name.replace("_", " "), words, _number(value, factor), span, unit])
    return rows
