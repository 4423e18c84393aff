"""What the headless way loads: no VTK to import it, and to run it nothing that draws, which needs a screen's
libraries on a slim machine."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

IMPORTS = """
import importlib, json, sys
import palpate as pp
pp.read_recording, pp.reconstruct, pp.press, pp.replay, pp.compare, pp.diagnose, pp.check, pp.batch
for name in ("reconstruct", "press", "replay", "compare", "diagnose", "check", "material"):
    importlib.import_module(f"palpate.operations.{name}")
import palpate.diagnosis.pipeline, palpate.reconstruction.pipeline, palpate.render.registry
"""
DRAWS = ("vtkmodules.vtkRenderingOpenGL2", "vtkmodules.vtkRenderingUI", "matplotlib", "pyvista.plotting")
TELL = "\nprint(json.dumps(sorted(sys.modules)))"


def loaded(code: str) -> set[str]:
    """Modules that a new process has after the code."""
    ran = subprocess.run([sys.executable, "-c", code + TELL], capture_output=True, text=True, check=True)
    return set(json.loads(ran.stdout.splitlines()[-1]))


def test_to_import_reconstruct_press_and_diagnose_needs_no_vtk_and_no_matplotlib():
    tops = {name.partition(".")[0] for name in loaded(IMPORTS)}
    assert "palpate" in tops and not tops & {"vtk", "vtkmodules", "pyvista", "matplotlib"}


@pytest.mark.slow
def test_a_press_of_a_model_loads_nothing_that_draws(block_folder: Path):
    press = f"pp.press({str(block_folder)!r}, at=(0, 0, 0.03), depth_m=0.002, progress=False).lines()"
    names = loaded(IMPORTS + press)
    assert "vtkmodules.vtkCommonDataModel" in names  # that reads mesh.vtu and finds nearest places
    drawn = {n for n in names if n.startswith(DRAWS)}
    assert not drawn
