"""A ball that moves by a low-rank change, against the object condensed anew with the ball in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from palpate.mechanics.model.material import balls_ratio
from palpate.mechanics.model.model import Model
from palpate.render.base import Renderer
from palpate.render.registry import create
from palpate.scenes.phantoms import Region
from palpate.scenes.scene import ball_of
from palpate.window.inclusion import MovingInclusion

from .small import block_model


def force(renderer: Renderer, x: float, y: float, depth: float = 0.004) -> float:
    """N, of a press onto the block's top."""
    heights = 0.045 + 0.002 - np.linspace(0.0, 0.002 + depth, 13)
    state = renderer.start(dt_s=0.01)
    for height in heights:
        forces = renderer.step(state, np.array([[x, y, height]]))[1]
    return float(forces[0, 2])


@pytest.mark.slow
def test_a_ball_that_came_by_dragging_is_felt_as_one_from_the_start(tmp_path: Path) -> None:
    block = block_model(tmp_path, cells=(6, 6, 3))
    plain = create("fem", block)
    moving = MovingInclusion(block, plain)
    balls = [Region("ball", (x, -0.002, 0.022), 0.008, 8.0) for x in (-0.02, -0.012, 0.003)]
    for number, ball in enumerate(balls):
        felt = moving.write(ball, tmp_path / f"{number}.npz").changed(plain)
    stated = block.with_material(field=balls_ratio(block.mesh, [ball_of(balls[-1])]))
    anew = create("fem", stated.replaced(path=None))
    for x, y in ((0.003, -0.002), (0.01, 0.01)):
        stiffer = force(felt, x, y) / force(plain, x, y) - 1.0
        wanted = force(anew, x, y) / force(plain, x, y) - 1.0
        # the block's elements are 13 mm, those of the tables made anew halved under the skin
        assert 0.03 < wanted and 0.6 * wanted < stiffer < 1.1 * wanted
    assert np.allclose(felt.compliance.blocks, anew.compliance.blocks, rtol=1e-4, atol=1e-3)
    for before, after in zip(plain.parameters, felt.parameters, strict=True):
        if isinstance(before, np.ndarray):
            for flag in ("C_CONTIGUOUS", "WRITEABLE"):  # else the compiled loop does not take it
                assert after.flags[flag] == before.flags[flag] and after.dtype == before.dtype
    gone = moving.write(None, tmp_path / "gone.npz").changed(felt)
    assert force(gone, 0.003, -0.002) == force(plain, 0.003, -0.002)
    fresh = MovingInclusion(block, plain).write(balls[-1], tmp_path / "fresh.npz").changed(plain)
    assert np.allclose(fresh.parameters.far, felt.parameters.far, rtol=1e-3, atol=1e-2), (
        "the way is forgotten"
    )


def test_one_dimensional_renderers_know_of_no_inside(block: Model, tmp_path: Path) -> None:
    moving = MovingInclusion(block, create("fem", block))
    change = moving.write(Region("ball", (0.0, 0.0, 0.024), 0.008, 8.0), tmp_path / "ball.npz")
    one_d = create("hunt-crossley", block)
    assert change.changed(one_d) is one_d
