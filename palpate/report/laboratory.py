"""Pictures of a simulated recording: the tip's path, the force in time, and every press's curve."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from scenes.laboratory.paths import SIDEWAYS
from scenes.laboratory.simulate import Simulation

_COLOURS = ("#c0392b", "#27ae60", "#2c6fbb")

PRESSES_SHOWN = 7
"""Presses whose curves are drawn: more would hide one another."""


def simulation_figure(result: Simulation) -> Figure:
    """Four panels: path, force in time, one touch, force against depth; grey and dashed is what the ideal
    object would answer to the same hand, where the simulation holds it.
    """
    figure = Figure(figsize=(13, 9), layout="constrained")
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
    ax.plot(*motion.position[:, [0, 2]].T, color="#b8c0cc", lw=0.4)
    traced = air & (np.linalg.norm(motion.trace_force, axis=1) > 0)
    ax.plot(*motion.position[traced][:, [0, 2]].T, ".", color="#8e44ad", ms=1, label="phase I")
    pressed = (motion.touch >= 0) & ((motion.s > 0) | (motion.leg == SIDEWAYS))
    ax.plot(*motion.position[pressed][:, [0, 2]].T, ".", color="#c0392b", ms=1, label="in contact")
    ax.set(xlabel="x [mm]", ylabel="z [mm]", title="path of the tip, seen along y", aspect="equal")
    ax.legend(loc="upper right", markerscale=6, fontsize=8)


def _time(ax, result: Simulation) -> None:
    t = result.recording.t
    ax.plot(t, np.linalg.norm(result.recording.force_on_tool, axis=1), color="#2c6fbb", lw=0.5, label="read")
    if result.ideal_n is not None:
        difference = np.linalg.norm(result.clean_n - result.ideal_n, axis=1)
        ax.plot(t, difference, color="#c0392b", lw=0.6, label="change of the force")
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
    for i, colour in enumerate(_COLOURS):
        ax.plot(t, result.recording.force_on_tool[rows, i], color=colour, lw=0.4, alpha=0.5)
        ax.plot(t, result.clean_n[rows, i], color=colour, lw=1.2, label=f"f{'xyz'[i]}")
        if result.ideal_n is not None:
            ax.plot(t, result.ideal_n[rows, i], color="#7f8c8d", lw=1, ls="--")
    touch = result.touches[number]
    title = f"touch {number}: {touch.kind}, {touch.depth:g} mm deep"
    ax.set(xlabel="time [s]", ylabel="force on the tool [N]", title=title)
    ax.legend(fontsize=8)


def _curves(ax, result: Simulation) -> None:
    """Some presses spread over the depths, and the one that differs most from the ideal object's, each at
    the depth that the instrument reads.
    """
    motion = result.motion
    turn = np.array(result.truth["device_from_object_rotation"])
    shift = np.array(result.truth["device_from_object_shift_mm"])
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
        ax.plot(depth, result.clean_n[rows] @ turn @ normal, color="#2c6fbb", lw=0.9)
        if result.ideal_n is not None:
            ideal = result.ideal_n[rows] @ turn @ normal
            ax.plot(motion.s[rows], ideal, color="#7f8c8d", lw=1.0, ls="--")
    ax.set(
        xlabel="depth as read (ideal: true depth) [mm]",
        ylabel="force along the normal [N]",
        title=f"{len(shown)} of {len(presses)} presses",
    )
