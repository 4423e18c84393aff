"""Force-response tests of one's own models: a pytest fixture that presses them headless.

In a test file or conftest.py: `from palpate.testing import press_model` (pytest finds it by its name), then

    def test_top_is_soft(press_model):
        curve = press_model("my-model", at=(0, 0, 0.08), direction=(0, 0, -1), depth_m=0.004)
        assert curve.force_at(0.004)[2] == pytest.approx(0.9, rel=0.05)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import pytest

from palpate.operations.press import press
from palpate.operations.renderer import renderer as make_renderer
from palpate.render.options import RenderOptions

if TYPE_CHECKING:
    from palpate.operations._shared import ModelLike
    from palpate.render.base import Renderer
    from palpate.render.press import Curve


@pytest.fixture(scope="session")
def press_model() -> Callable[..., Curve]:
    """`palpate.press` that reads every model and makes every renderer once a session.

    A function `press_model(model_or_scene, at, direction=None, depth_m=0.004, speed_m_per_s=0.01,
    renderer="fem", ...)`; lengths m, speed m/s, forces N on the tool, device frame.
    """
    ours = set(RenderOptions.__dataclass_fields__)

    @cache
    def renderer_of(model: ModelLike, name: str, given: tuple[tuple[str, Any], ...]) -> Renderer:
        return make_renderer(model, name, progress=False, **dict(given))

    def pressed(
        model_or_scene: ModelLike,
        at: Sequence[float],
        direction: Sequence[float] | None = None,
        depth_m: float = 0.004,
        speed_m_per_s: float = 0.01,
        *,
        renderer: str = "fem",
        **more: Any,
    ) -> Curve:
        given = tuple(sorted((name, value) for name, value in more.items() if name in ours))
        made = renderer_of(model_or_scene, renderer, given)
        rest = {name: value for name, value in more.items() if name not in ours}
        return press(made, at, direction, depth_m, speed_m_per_s, **rest)

    return pressed
