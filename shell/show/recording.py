"""A recording: its size in lines, force over time, the tip's path."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.recording.recording import Recording
from palpate.show.colours import COLOURS
from palpate.show.story import Detail, Headline, Story
from palpate.words import mm, mn

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter


def story(result: Recording) -> Story:
    """Its size, and where its base was traced."""
    phase, noise = result.boundary_phase, result.force_noise_std_n
    size = np.ptp(result.position, axis=0) * 1e3
    yield Headline(
        f"Recording {result.name}: {result.object_name}, {result.duration_s:.1f} s, "
        f"{len(result.t)} samples at {result.sample_rate_hz:g} Hz"
    )
    yield Detail(
        f"tip radius {mm(result.tip_radius_m, '.4g')}; path within {size[0]:.0f} x {size[1]:.0f} x "
        f"{size[2]:.0f} mm; force up to {result.force_n.max():.4g} N"
        + ("" if noise is None else f"; sensor noise {mn(noise, '.4g')} an axis")
    )
    traced = "not stated, found by reconstruction" if phase is None else f"{phase[0]:g} to {phase[1]:g} s"
    yield Detail(f"tracing around the foot: {traced}")


def draw(result: Recording, ax: Axes) -> None:
    """Force over time."""
    ax.plot(result.t, result.force_n, lw=0.7, color=COLOURS["measured"])
    if result.boundary_phase is not None:
        ax.axvspan(*result.boundary_phase, color=COLOURS["base-tracing"], zorder=0, label="tracing the foot")
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False)
    ax.set(xlabel="time [s]", ylabel="force magnitude [N]", xlim=(result.t[0], result.t[-1]))


def place(result: Recording, plotter: Plotter) -> None:
    """The tip's path, coloured by force."""
    from palpate.show.scenery import add_path, look_around

    add_path(plotter, result.position, result.force_n, "force magnitude [N]")
    look_around(plotter, np.array([0.0, 0.0, 1.0]), result.position)
