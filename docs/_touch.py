"""The site's pages that can be pressed (docs/touch.md): `python docs/_touch.py FOLDER` writes them all.

`started` makes them in a process of its own while the site is built, which leaves a core to it; `finished`
waits for that. Models come with the program or are made by its scenes, all from embedded data.
"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

OBJECTS = ("demo", "silicone-2", "silicone-3", "bean", "nodule")
"""Scenes; the page of each is FOLDER/NAME.html."""
COARSE_M = 0.014
"""Edges of the elements where a model must be made: two thirds of the time, and forces within a percent."""


def write(folder: Path) -> None:
    """One page for each object, titled as its scene is."""
    from palpate.exporting.page.document import page_of
    from palpate.render.fem.renderer import FemRenderer
    from palpate.scenes.build import model_of
    from palpate.scenes.scene import load_scene

    folder.mkdir(parents=True, exist_ok=True)
    for name in OBJECTS:
        scene = load_scene(name)
        if scene.kind == "phantom" and not scene.inclusions:
            scene = replace(scene, mesh_size_m=COARSE_M)
        page = page_of(FemRenderer(model_of(scene)), title=scene.title)
        (folder / f"{name}.html").write_text(page, encoding="utf-8")


def started(folder: Path) -> subprocess.Popen[bytes]:
    """The process that writes the pages."""
    return subprocess.Popen([sys.executable, __file__, str(folder)])


def finished(process: subprocess.Popen[bytes]) -> None:
    """Wait for it. Raises RuntimeError where it failed."""
    if process.wait():
        raise RuntimeError("the pages that can be pressed were not written: see above")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
