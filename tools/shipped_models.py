"""Make the models that come with the program (scenes.shipped): those of the demo and of the hidden nodule.

Each is made as `palpate touch` makes it on a machine that has none: the model, the compliance of its surface,
and each place's own stiffness, which colours the window. Run it where a test says that law, key or forces
differ from what is shipped; commit what it writes once a release, as each time adds megabytes to the history.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.compliance.stored_compliance import compliance_key, load_or_condense
from palpate.mechanics.model.files import write_model
from palpate.mechanics.model.model import Model
from palpate.render.fem.renderer import FemRenderer
from palpate.render.surface.felt_surface import with_own_stiffness
from palpate.scenes.build import model_of
from palpate.scenes.kept import folder_name
from palpate.scenes.scene import FOLDER as SCENES
from palpate.scenes.scene import read_scene
from palpate.scenes.shipped import FOLDER, pack
from tools.script import script

SHIPPED = ("demo", "nodule")
AIR_N = 1e-6
"""To which the force in free air is rounded: a ten-thousandth of a sensor's noise, a third of the file."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which, and where to."""
    parser.add_argument("scenes", nargs="*", default=list(SHIPPED), help="scenes; none: all that are shipped")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="where the archives go")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Make them; bytes of each. An archive of the same object under another key is removed."""
    sizes = {}
    for name in arguments.scenes:
        archive = make(name, arguments.folder)
        for old in arguments.folder.glob(archive.stem.rpartition("-")[0] + "-*.zip"):
            if old != archive:
                old.unlink()
        sizes[archive.name] = archive.stat().st_size
        print(f"{archive}: {sizes[archive.name] / 1e6:.2f} MB")
    return {"bytes": sizes}


def make(name: str, folder: Path) -> Path:
    """Make a scene's model anew, and its archive in the folder; returns the archive's path."""
    scene = read_scene(SCENES / f"{name}.toml")
    with tempfile.TemporaryDirectory() as work:
        made = model_of(scene, cache=Path(work), shipped=False)
        made = _rounded(made)
        path = write_model(Path(work) / "model", made)
        made = made.replaced(path=path)
        compliance = load_or_condense(made)
        with_own_stiffness(FemRenderer(made, compliance=compliance))
        archive = folder / f"{folder_name(scene)}.zip"
        pack(path, archive, compliance, compliance_key(made))
    return archive


def _rounded(model: Model) -> Model:
    presses = model.presses
    return model.replaced(presses=replace(presses, free_air=AIR_N * np.round(presses.free_air / AIR_N)))


if __name__ == "__main__":
    sys.exit(script(sys.modules[__name__]))
