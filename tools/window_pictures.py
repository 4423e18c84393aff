"""Make the pictures of the touch window in `docs/images`: `window`, `window-settings`, `window-gallery`.

Off screen, a hand on the mouse presses the demo's cylinder; then the nodule, with the settings open; then the
gallery is shown. `--size` makes them as another screen shows them.
"""

from __future__ import annotations

import argparse
import sys
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.disk.writing import PNG, atomic_file
from palpate.operations.touch import DEFAULT, _gallery
from palpate.scenes.build import model_of
from palpate.scenes.scene import load_scene
from palpate.window.session import SessionOptions
from palpate.window.waiting import WaitingWindow
from tests.shell.window.driven import Driven, driving
from tools.script import script

FOLDER = Path(__file__).parent.parent / "docs" / "images"
SIZE = (1280, 800)
FRAMES = 20
"""Drawn before a picture is taken: a slow machine leaves the second view and the words out of some."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where they go, and how large the window is."""
    parser.add_argument("--folder", type=Path, default=FOLDER, help="where they are written")
    parser.add_argument("--size", type=int, nargs=2, default=SIZE, metavar=("W", "H"), help="pixels")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Write the three; how large they are."""
    size = (arguments.size[0], arguments.size[1])
    with _touched(DEFAULT, size) as driven:
        _press(driven, 0.5, 0.62)
        _write(arguments.folder / "window.png", driven.picture())
    with _touched("nodule", size) as driven:
        driven.click("Settings")
        _press(driven, 0.5, 0.55)
        _write(arguments.folder / "window-settings.png", driven.picture())
    window = WaitingWindow(_gallery(), size=size, off_screen=True)
    window.plotter.render()
    _write(arguments.folder / "window-gallery.png", np.asarray(window.plotter.screenshot(return_img=True)))
    window.close()
    return {"size_px": size}


def _touched(name: str, size: tuple[int, int]) -> AbstractContextManager[Driven]:
    """The window of an embedded scene, with a hand on its mouse."""
    scene = load_scene(name)
    return driving(model_of(scene), scene, SessionOptions(scene.renderer, beside=scene.beside), size=size)


def _press(driven: Driven, x: float, y: float) -> None:
    """Down to the depth of a press at these shares of the first picture, and held there for a while."""
    driven.mouse(x, y)
    driven.rests(0.3)
    driven.button(True)
    driven.pressed(driven.window.pointer.press_depth_m)
    driven.wait(4.0)
    for _ in range(FRAMES):
        driven.frame()
        driven.window.plotter.render()


def _write(path: Path, picture: np.ndarray) -> None:
    from matplotlib.image import imsave

    with atomic_file(path, PNG) as temporary:
        imsave(temporary, picture, format="png")


if __name__ == "__main__":
    sys.exit(script(sys.modules[__name__]))
