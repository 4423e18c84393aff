"""Force-response tests of one's own models: a pytest fixture that presses them headless.

In a test file or conftest.py: `from palpate.testing import press_model` (pytest finds it by its name), then

    def test_top_is_soft(press_model):
        curve = press_model("my-model", at=(0, 0, 0.08), direction=(0, 0, -1), depth_m=0.004)
        assert curve.force_at(0.004)[2] == pytest.approx(0.9, rel=0.05)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from palpate.sources import open_scene
from render.options import RenderOptions
from render.press import Curve, press
from render.scene import TouchScene
from render.support import SupportOptions


@pytest.fixture(scope="session")
def press_model() -> Callable[..., Curve]:
    """A function `press_model(model_or_scene, at, direction, depth_m, speed_m_per_s=0.01, renderer="fem",
    ...)`.

    It returns the render.press.Curve; other keywords go to render.press.press, `options` is a RenderOptions,
    `support` a SupportOptions. Models and renderers are read and made once a session.
    """

    @cache
    def scene_of(
        source: str, name: str, options: RenderOptions | None, support: SupportOptions | None
    ) -> TouchScene:
        return open_scene(source, name, options, support)

    def pressed(
        model_or_scene: str | Path,
        at: Sequence[float],
        direction: Sequence[float],
        depth_m: float,
        speed_m_per_s: float = 0.01,
        *,
        renderer: str = "fem",
        options: RenderOptions | None = None,
        support: SupportOptions | None = None,
        **more: Any,
    ) -> Curve:
        scene = scene_of(str(model_or_scene), renderer, options, support)
        return press(scene, at, direction, depth_m, speed_m_per_s, **more)

    return pressed
