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


def test_to_press_a_model_needs_nothing_of_scipy_that_fits_or_filters():
    """They took a second of every press."""
    names = loaded(
        "import json, sys, palpate.operations.press, palpate.show.curve, palpate.render.exact\n"
        "import palpate.render.fem.renderer, palpate.render.force_error, palpate.render.press"
    )
    assert "scipy.spatial" in names
    assert not names & {f"scipy.{part}" for part in ("interpolate", "ndimage", "optimize", "signal", "stats")}


COMMANDS = {
    "press": "press demo --at 0,0,0.08 --depth 0.003 --json press.json",
    "reconstruct": "reconstruct silicone-1-cylinder -o MODEL --json made.json",
    "diagnose": "diagnose silicone-1-cylinder --model demo --fast --json gap.json",
}
"""What runs without a screen. VTK reads mesh.vtu and finds nearest places: that is no matter of imports."""


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_that_writes_json_loads_nothing_that_draws(name, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = COMMANDS[name].split()
    names = loaded(f"import sys, json\nfrom palpate.cli import main\nassert main({words!r}) == 0")
    assert "vtkmodules.vtkCommonDataModel" in names and "numba" in names
    assert not {n for n in names if n.startswith(DRAWS)}
