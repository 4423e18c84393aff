"""A new renderer is one file and its line in the registry."""

from __future__ import annotations

import sys
from types import ModuleType

import numpy as np
import pytest

from palpate.mechanics.model.one_d_laws import LAWS
from palpate.render.one_d import OneDRenderer
from palpate.render.press import Stroke, press
from palpate.render.registry import RENDERERS, create, names


def _module() -> ModuleType:
    """What `render/twice.py` would hold: springs of twice the stiffness."""
    module = ModuleType("palpate.render.twice")

    def made(name, model, options, progress):
        fits = {key: 2 * np.asarray(values) for key, values in model.presses.fits.items()}
        return OneDRenderer(name, model, LAWS["kelvin-voigt"](fits), options)

    module.create = made
    return module


def test_a_renderer_is_added_in_one_file_and_one_line(one_d_model, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "palpate.render.twice", _module())
    monkeypatch.setitem(RENDERERS, "twice", "palpate.render.twice")
    assert "twice" in names()
    at, down = one_d_model.presses.point[0], [0.0, 0.0, -1.0]
    once, twice = (
        press(create(name, one_d_model), at, down, Stroke(2e-3, 0.02)) for name in ("kelvin-voigt", "twice")
    )
    assert once.peak_force_n > 0
    assert twice.peak_force_n == pytest.approx(2 * once.peak_force_n, rel=1e-6)
