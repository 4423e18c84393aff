"""A simulated exploration and the truth about it: the tip's path, the force in time, every press."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.frames import tangents
from palpate.scenes.laboratory.paths import SIDEWAYS
from palpate.scenes.laboratory.simulate import Simulation
from palpate.show import story as say
from palpate.show.colours import COLOURS
from palpate.show.page import file_words, new_figure
from palpate.show.quantities import DEPTH, ERROR, ORDER
from palpate.show.view3d import Colouring, Line, Thing, Traces, View
from palpate.words import kpa, listed, mn, spaced

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN_AS = "recording"
PRESSES_SHOWN = 7
"""Presses whose curves are drawn: more would hide one another."""


def story(result: Simulation) -> say.Story:
    """What was simulated, and how large each effect is."""
    yield say.Title(f"Simulated exploration of {result.recording.object_name}")
    recording, truth = result.recording, result.truth
    seconds, count = f"{recording.t[-1]:.0f} s of readings", f"{len(result.touches)} touches"
    yield say.Headline(
        f"Simulation {recording.name}: {seconds}, {count} of the {result.phantom}", on=say.TEXT
    )
    yield say.Detail(f"effects: {', '.join(map(spaced, truth['strengths'])) or 'none'}", on=say.TEXT)
    each = [f"{spaced(name)} of strength {value:g}" for name, value in truth["strengths"].items()]
    effects = f"with {listed(each)} (1 is usual)" if each else "without any effect"
    yield say.Headline(
        f"{count} in {seconds} of an object of {kpa(truth['young_modulus_pa'], '.1f')}, {effects}",
        on=say.PAGE,
    )
    noise = recording.force_noise_std_n
    yield say.Sentence(
        "The recording holds what a device would have read; the truth is stored next to it and no "
        "command uses it."
        + (f" The sensor's noise is {mn(noise)} an axis: a smaller effect is hard to see." if noise else ""),
        on=say.PAGE,
    )
    where = file_words(recording.path, "REC")
    yield say.Next([
        f"see whether it is found: `palpate reconstruct {where} -o MODEL`, then "
        f"`palpate diagnose {where} --model MODEL --report PAGE.html`",
        "feel it: `palpate touch MODEL`",
    ])  # fmt: skip
    yield say.Turned(
        lambda: view(result),
        say.Picture(
            lambda: simulation_figure(result),
            "Path of the tip, force in time, the longest drag or touch, and some presses; brown and "
            "dashed: the "
            "force of the ideal object under the same hand.",
        ),
    )
    sizes = truth.get("sizes", {})
    for name, size in sizes.items():
        yield say.Detail(
            f"{spaced(name)} changes the force by {mn(size['rms_n'], '.3g')}; "
            f"{mn(size['rms_after_best_scale_n'], '.3g')} of that stays when another modulus is fitted",
            on=say.TEXT,
        )
    if sizes:
        rows = [
            [spaced(name), *(f"{1e3 * size[key]:.1f}" for key in ("rms_n", "rms_after_best_scale_n"))]
            for name, size in sizes.items()
        ]
        heads = ["effect", "change of the force [mN]", "left with another modulus [mN]"]
        yield say.Section("How large is each effect?", [say.Rows(heads, rows)])


KEYS: tuple[say.Key, ...] = (
    "recording=recording.path",
    ("samples", lambda result: len(result.recording.t)),
    ("duration_s", lambda result: result.recording.t[-1]),
    ("palpations", lambda result: len(result.touches)),
    "truth",
)


def view(result: Simulation) -> View:
    """The phantom in the device's frame; each touch as read, without noise, and of the ideal object."""
    motion, recording = result.motion, result.recording
    turn, shift = _device(result)
    rows = [
        np.flatnonzero((motion.touch == k) & (motion.s > -_BEFORE_MM)) for k in range(len(result.touches))
    ]
    normals = np.array([touch.normal for touch in result.touches]) @ turn.T
    frame = np.repeat([np.stack([n, *tangents(n)]) for n in normals], [len(r) for r in rows], axis=0)
    chosen = np.concatenate(rows)
    starts = np.cumsum([0, *map(len, rows)])
    met = [r[np.argmax(motion.s[r] >= 0.0)] if len(r) else 0 for r in rows]
    first = np.repeat(met, [len(r) for r in rows])
    depth_m = motion.s[chosen] * 1e-3
    read = (1e3 * recording.position[chosen] - shift) @ turn
    inward = -np.repeat([touch.normal for touch in result.touches], [len(r) for r in rows], axis=0)
    read_m = depth_m + 1e-3 * ((read - motion.position[chosen]) * inward).sum(axis=1)
    lines = [
        Line("read", _turned(frame, recording.force_on_tool[chosen]), "measured", depth_m=read_m),
        Line("without noise", _turned(frame, result.clean_n[chosen]), "effect", False, read_m),
    ]
    colourings = [
        Colouring(ORDER, None, np.arange(1.0, len(rows) + 1), "Each dot is a touch, in order of time."),
        Colouring(DEPTH, None, np.array([touch.depth for touch in result.touches]) * 1e-3),
    ]
    if result.ideal_n is not None:
        lines.insert(1, Line("ideal object", _turned(frame, result.ideal_n[chosen]), "simplest"))
        change = result.clean_n - result.ideal_n
        each = np.array([np.sqrt((change[r] ** 2).sum(axis=1).mean()) for r in rows])
    if result.ideal_n is not None and each.max() > _LEAST_CHANGE_N:
        words = "What the effects change, root mean square over each touch; between touches what is near."
        colourings.append(Colouring(ERROR, None, each, words, name="change of the force"))
    places = np.array([touch.point for touch in result.touches]) @ turn.T + shift
    assert result.body is not None, "only what `simulate` returned knows what was explored"
    phantom = result.body
    thing = Thing(
        phantom.vertices @ turn.T + 1e-3 * shift,
        phantom.faces,
        phantom.vertices[:, 2] > 1e-4,
        shift * 1e-3,
        turn[:, 2],
    )
    traces = Traces(starts, depth_m, (chosen - first) * (motion.t[1] - motion.t[0]), lines)
    return View(thing, places * 1e-3, colourings, traces)


def _device(result: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """(rotation (3, 3), shift (3,) mm) from the object's to the device's frame."""
    truth = result.truth
    return np.array(truth["device_from_object_rotation"]), np.array(truth["device_from_object_shift_mm"])


def _turned(frame: np.ndarray, force_n: np.ndarray) -> np.ndarray:
    return np.einsum("nij,nj->ni", frame, force_n)


_LEAST_CHANGE_N = 1e-4
_BEFORE_MM = 1.0
"""Above the surface: where the curve of a touch begins and ends."""


def simulation_figure(result: Simulation) -> Figure:
    """Four panels: path, force in time, one touch, force against depth; brown and dashed is what the ideal
    object would answer to the same hand, where the simulation holds it.
    """
    figure = new_figure(13, 9, layout="constrained")
    axes = figure.subplots(2, 2)
    _path(axes[0, 0], result)
    _time(axes[0, 1], result)
    _touch(axes[1, 0], result)
    _curves(axes[1, 1], result)
    effects = ", ".join(f"{k} {v:g}" for k, v in result.truth["strengths"].items()) or "no effect"
    figure.suptitle(f"{result.recording.object_name}: {effects}")
    return figure


def _path(ax, result: Simulation) -> None:
    motion = result.motion
    air = motion.touch < 0
    ax.plot(*motion.position[:, [0, 2]].T, color=COLOURS["path"], lw=0.4)
    traced = air & (np.linalg.norm(motion.trace_force, axis=1) > 0)
    ax.plot(*motion.position[traced][:, [0, 2]].T, ".", color=COLOURS["base"], ms=1, label="on the support")
    pressed = (motion.touch >= 0) & ((motion.s > 0) | (motion.leg == SIDEWAYS))
    ax.plot(*motion.position[pressed][:, [0, 2]].T, ".", color=COLOURS["touch"], ms=1, label="in contact")
    ax.set(xlabel="x [mm]", ylabel="z [mm]", title="path of the tip, seen along y", aspect="equal")
    ax.legend(loc="upper right", markerscale=6, fontsize=8)


def _time(ax, result: Simulation) -> None:
    t = result.recording.t
    ax.plot(
        t,
        np.linalg.norm(result.recording.force_on_tool, axis=1),
        color=COLOURS["measured"],
        lw=0.5,
        label="read",
    )
    if result.ideal_n is not None:
        difference = np.linalg.norm(result.clean_n - result.ideal_n, axis=1)
        ax.plot(t, difference, color=COLOURS["change"], lw=0.6, label="change of the force")
    parts = [("trace", *result.motion.phase), *result.motion.beside]
    for k, (kind, start, end) in enumerate(parts):
        ax.axvspan(start, end, color=COLOURS["base-tracing" if k == 0 else "interval"], alpha=0.7, lw=0)
        ax.text((start + end) / 2, 0.98, kind, transform=ax.get_xaxis_transform(), ha="center", va="top",
                fontsize=8, rotation=90)  # fmt: skip
    ax.set(xlabel="time [s]", ylabel="|force| [N]", title="force in time")
    ax.legend(fontsize=8)


def _touch(ax, result: Simulation) -> None:
    """The longest drag, or else the longest touch."""
    motion = result.motion
    length = np.bincount(motion.touch[motion.touch >= 0])
    drags = np.array([bool(touch.side.any()) for touch in result.touches])
    number = int(np.where(drags, length + length.max(), length).argmax())
    rows = np.flatnonzero((motion.touch == number) & (motion.s > -6))
    t = result.recording.t[rows]
    for i, colour in enumerate(COLOURS[name] for name in "xyz"):
        ax.plot(t, result.recording.force_on_tool[rows, i], color=colour, lw=0.4, alpha=0.5)
        ax.plot(t, result.clean_n[rows, i], color=colour, lw=1.2, label=f"f{'xyz'[i]}")
        if result.ideal_n is not None:
            ax.plot(t, result.ideal_n[rows, i], color=COLOURS["simplest"], lw=1, ls="--")
    touch = result.touches[number]
    title = f"touch {number}: {touch.kind}, {touch.depth:g} mm deep"
    ax.set(xlabel="time [s]", ylabel="force on the tool [N]", title=title)
    ax.legend(fontsize=8)


def _curves(ax, result: Simulation) -> None:
    """Some presses spread over the depths, and the one that differs most from the ideal object's, each at
    the depth that the instrument reads.
    """
    motion = result.motion
    turn, shift = _device(result)
    read = (1e3 * result.recording.position - shift) @ turn
    presses = [k for k, touch in enumerate(result.touches) if touch.kind == "press"]
    presses.sort(key=lambda k: result.touches[k].depth)
    shown = np.unique(np.linspace(0, len(presses) - 1, PRESSES_SHOWN).round().astype(int))
    if result.ideal_n is not None:
        change = np.linalg.norm(result.clean_n - result.ideal_n, axis=1)
        shown = np.union1d(shown, np.argmax([change[motion.touch == k].max() for k in presses]))
    for k in shown:
        normal = result.touches[presses[k]].normal
        rows = np.flatnonzero((motion.touch == presses[k]) & (motion.s > -1.0))
        depth = motion.s[rows] + (motion.position[rows] - read[rows]) @ normal
        ax.plot(depth, result.clean_n[rows] @ turn @ normal, color=COLOURS["measured"], lw=0.9)
        if result.ideal_n is not None:
            ideal = result.ideal_n[rows] @ turn @ normal
            ax.plot(motion.s[rows], ideal, color=COLOURS["simplest"], lw=1.0, ls="--")
    ax.set(
        xlabel="depth as read (ideal: true depth) [mm]",
        ylabel="force along the normal [N]",
        title=f"{len(shown)} of {len(presses)} presses",
    )
