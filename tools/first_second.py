"""Make `docs/images/first-second.png`: the touch window's first second and the next, as pictures and force.

The window of an embedded scene is opened off screen with a hand on its mouse, whose button goes down with the
first picture: the tip comes down from where the window puts it, and presses. The force is the servo's own,
every millisecond; time is its clock since the first picture.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.disk.writing import PNG, atomic_file
from palpate.operations.touch import DEFAULT
from palpate.scenes.build import model_of
from palpate.scenes.scene import load_scene
from palpate.show.page import new_figure
from palpate.window.session import SessionOptions
from tests.shell.window.driven import Driven, driving
from tools.script import script

FILE = Path(__file__).parent.parent / "docs" / "images" / "first-second.png"
SIZE = (800, 600)
LASTS_S = 2.0
AT = (0.5, 0.62)
"""Of the first picture, where the mouse is."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What is touched, in how many pictures, and where they go."""
    parser.add_argument("--scene", default=DEFAULT, help=f"an embedded scene (default: {DEFAULT})")
    parser.add_argument("--pictures", type=int, default=6, help="shown, evenly in time (default: 6)")
    parser.add_argument("--seconds", type=float, default=LASTS_S, help=f"watched (default: {LASTS_S:g})")
    parser.add_argument("--output", type=Path, default=FILE, help="the file that is written")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Write it; when pictures were taken, s; greatest force, and its step in a millisecond, N."""
    scene = load_scene(arguments.scene)
    options = SessionOptions(scene.renderer)
    with driving(model_of(scene), scene, options, size=SIZE) as driven:
        times, pictures, history = _watched(driven, arguments.seconds, arguments.pictures)
    force = np.linalg.norm(history["rendered"], axis=1)
    _draw(arguments.output, times, pictures, history["time_s"], force)
    return {
        "shown_s": [round(float(time), 3) for time in times],
        "first_second_n": float(force[history["time_s"] <= 1.0].max()),
        "greatest_n": float(force.max()),
        "greatest_step_n": float(np.abs(np.diff(force)).max()),
    }


def _watched(driven: Driven, lasts_s: float, wanted: int) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """Of so long: (p,) s, p pictures of what is felt, and the servo's rows with times of that clock."""
    driven.mouse(*AT)
    began = driven.frame().time_s
    times, pictures = [], []
    for due in np.linspace(0.0, lasts_s, wanted):
        frame = driven.wait(max(0.0, began + due - driven.frame().time_s))
        pictures.append(_felt(driven))
        times.append(frame.time_s - began)
        driven.button(True)
    history = driven.session.servo.history()[0]
    history["time_s"] -= began
    within = (history["time_s"] >= 0) & (history["time_s"] <= times[-1])
    return np.array(times), pictures, history[within]


def _felt(driven: Driven) -> np.ndarray:
    """(h, w, 3) the first picture of the window as it is now."""
    whole = driven.picture()
    left, low, right, high = driven.window.picture_renderers[0].viewport
    height, width = whole.shape[:2]
    return whole[
        round((1 - high) * height) : round((1 - low) * height), round(left * width) : round(right * width)
    ]


def _draw(
    path: Path, times: np.ndarray, pictures: list[np.ndarray], clock: np.ndarray, force: np.ndarray
) -> None:
    figure = new_figure(12.0, 4.6, layout="constrained")
    grid = figure.add_gridspec(2, len(pictures), height_ratios=(1.0, 0.9))
    below = figure.add_subplot(grid[1, :])
    below.plot(clock, force, color="black", linewidth=1.2)
    for k, (time, picture) in enumerate(zip(times, pictures, strict=True)):
        axes = figure.add_subplot(grid[0, k])
        axes.imshow(picture)
        axes.set_title(f"{time:.2f} s", fontsize=11)
        axes.set_axis_off()
        below.axvline(time, color="0.6", linewidth=0.8, linestyle=":")
        below.plot(time, np.interp(time, clock, force), "o", color="black", markersize=5)
    below.set(xlim=(0.0, clock[-1]), xlabel="time since the first picture [s]", ylabel="force [N]")
    below.axvspan(0.0, 1.0, color="0.93", zorder=0)
    below.annotate("the first second", (0.5, 0.9), xycoords=("data", "axes fraction"), ha="center")
    below.set_ylim(bottom=0.0)
    with atomic_file(path, PNG) as temporary:
        figure.savefig(temporary, format="png", dpi=130)


if __name__ == "__main__":
    sys.exit(script(sys.modules[__name__]))
