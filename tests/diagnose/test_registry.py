"""An effect is one file and one line of the registry: nothing else in the program knows its name."""

from __future__ import annotations

import ast
import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from palpate.diagnosis.apply import improved
from palpate.diagnosis.options import DiagnoseOptions
from palpate.diagnosis.pipeline import diagnose
from palpate.mechanics.contact.dent import dent_law, grid
from palpate.mechanics.effects import registry
from palpate.render.effects import rendered_touch
from palpate.render.options import RenderOptions
from palpate.show.diagnosis.words import meaning

ROOT = Path(__file__).resolve().parents[2]
ALSO = {
    "poisson_ratio": "a number of the material in recordings, models and reports",
    "inclusion": "a region that the window draws, and the truth that it writes",
}
"""Words that name more than the effect."""

TOY = '''
"""A brittle shell: stiff at first touch, gone once it is dented by a tenth of the tip's radius."""

import numpy as np

from palpate.mechanics.contact.dent import grid
from palpate.mechanics.effects.base import Effect, Parameter, Scope, unchanged


def _touch(touch, keys, model):
    factor = 1 + keys["strength"] * np.exp(-grid() / 0.1)
    touch.factors.append(lambda poisson_ratio: (factor, factor))


EFFECT = Effect(
    name="brittle_shell",
    domain="contact",
    scope=Scope.PRESS,
    words="a shell breaks where the tip goes in",
    parameters=(Parameter("strength", "1", 0.0, 10.0, 0.0, (0.5,), 0.02),),
    report=lambda values, scene, modulus_pa: {"strength": float(values[0])},
    touch=_touch,
    apply=unchanged,
)
'''
STRENGTH = 3.0


@pytest.fixture
def toy(tmp_path, monkeypatch):
    """The name of an effect that is one file and one line of the registry."""
    name = "brittle_shell"
    path = tmp_path / f"{name}.py"
    path.write_text(TOY)
    spec = importlib.util.spec_from_file_location(f"palpate.mechanics.effects.{name}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setitem(sys.modules, f"palpate.mechanics.effects.{name}", module)
    monkeypatch.setattr(registry, "NAMES", (*registry.NAMES, name))
    return name


def test_an_effect_is_added_in_one_file_and_one_line(bench, toy):
    """It is tried, named, measured, applied, rendered and put into words."""
    factor = 1 + STRENGTH * np.exp(-grid() / 0.1)
    recording, model = bench.record(law=dent_law("neo-hookean").scaled(factor, factor))
    result = diagnose(recording, model, DiagnoseOptions(fast=True, bootstrap=100))
    assert toy in result.attribution.scores
    assert result.effects[0] == toy
    entry = result.entries[0]
    assert entry.name == toy and entry.domain == "contact"
    assert entry.parameters["strength"] == pytest.approx(STRENGTH, rel=0.3)
    low, high = entry.intervals["strength"]
    assert low < entry.parameters["strength"] < high
    better, kept = improved(model, result)
    assert toy in kept and better.effects[toy] == entry.parameters
    touch = rendered_touch(better, RenderOptions())
    rendered = touch.law_of_dent(0.49).table[:, 0] / dent_law(touch.dent_law).table[:, 0]
    np.testing.assert_allclose(rendered, 1 + entry.parameters["strength"] * np.exp(-grid() / 0.1))
    assert meaning(toy) == "a shell breaks where the tip goes in"


def test_without_its_line_it_is_unknown(bench):
    with pytest.raises(Exception, match="brittle_shell"):
        diagnose(*bench.record(), DiagnoseOptions(without="brittle_shell"))


@pytest.mark.parametrize("room", ["diagnose", "render", "reconstruct", "shell"])
def test_no_room_knows_an_effect_by_name(room):
    """String literals only: docstrings and comments may name what they like."""
    found = []
    for path in sorted((ROOT / room).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and node.value in registry.NAMES and node.value not in ALSO:
                found.append(f"{path.relative_to(ROOT)}:{node.lineno}: {node.value}")
    assert not found


def test_an_effects_file_is_named_as_the_effect_and_names_no_other():
    for name in registry.NAMES:
        effect = registry.effect(name)
        assert effect.name == name
        tree = ast.parse((ROOT / "mechanics" / "effects" / f"{name}.py").read_text(encoding="utf-8"))
        words = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)}
        others = {word for word in words if word in registry.NAMES} - {name, *ALSO}
        assert not others, f"{name} names {others}"
