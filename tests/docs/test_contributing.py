"""The listing of CONTRIBUTING.md is a simulator, that of the how-to is an effect: one file and one line, as
they stand."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from palpate.mechanics.effects import registry as known_effects
from palpate.mechanics.model.files import read_model
from palpate.render import registry
from palpate.render.press import Stroke, press

from .test_blocks_run import DOCS, code_of

PAGE = Path(__file__).resolve().parents[2] / "CONTRIBUTING.md"


@pytest.fixture
def bed(monkeypatch: pytest.MonkeyPatch) -> str:
    text = PAGE.read_text(encoding="utf-8")
    found = re.search(r"<!-- listing: render/simulators/bed.py -->\n```python\n(.*?)```", text, re.DOTALL)
    name, where = re.search(r'^    "(\w+)": "([\w.]+:\w+)",$', text, re.MULTILINE).groups()
    module = ModuleType(where.partition(":")[0])
    monkeypatch.setitem(sys.modules, module.__name__, module)
    exec(compile(found[1], str(PAGE), "exec"), module.__dict__)
    monkeypatch.setitem(registry._SIMULATORS, name, where)
    return name


def test_the_listed_simulator_is_a_bed_of_springs(bed, block_folder):
    model = read_model(block_folder)
    made = registry.create(bed, model)
    nodes = np.unique(model.mesh.linear().touchable_surface)
    points = model.mesh.points[nodes]
    middle = points[points[:, 2] > 0.029]
    at = middle[np.argmin(np.linalg.norm(middle[:, :2], axis=1))]
    curve = press(made, at, [0.0, 0.0, -1.0], Stroke(1e-3, 0.02))
    # a tip smaller than the mesh presses one node: the area that is its own, on springs of E over the height
    area = 0.015**2
    stiffness = model.material.young_modulus_pa / 0.03 * area
    assert curve.peak_force_n == pytest.approx(stiffness * 1e-3, rel=0.25)
    assert np.allclose(curve.force[0], 0) and curve.force[curve.deepest, 2] > 0


def test_the_listed_effect_reads_no_more_than_its_range(monkeypatch: pytest.MonkeyPatch):
    module = ModuleType("palpate.mechanics.effects.saturation")
    exec(compile(code_of(DOCS / "howto" / "write-an-effect.md")[0], "saturation.py", "exec"), module.__dict__)
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(known_effects, "NAMES", (*known_effects.NAMES, "saturation"))
    effect = known_effects.effects()[-1]
    force = np.array([[0.0, 0.0, 3.0], [0.6, 0.0, 0.8], [0.0, 0.0, 0.0]])
    assert np.allclose(module.saturate(force, 1.5), [[0.0, 0.0, 1.5], [0.6, 0.0, 0.8], [0.0, 0.0, 0.0]])
    assert effect.name == "saturation" and np.array_equal(module.saturate(force, effect.ideal[0]), force)
