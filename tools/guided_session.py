"""Make the picture of a guided session: `docs/images/guided-session.png`.

A hand on the mouse of a touch window, off screen, explores the scene of the hidden nodule as `palpate explore
--device mouse` has it, with its goals: slides round the foot, then presses where the ghost stands until the
guide is content. Four moments make the picture, row by row: half way round, the first ghost, the last one,
done. It takes some minutes, and no screen.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from palpate.diagnosis.explore.explorer import Explorer
from palpate.diagnosis.explore.goals import GoalOptions
from palpate.diagnosis.explore.segments import Instrument
from palpate.mechanics.disk.writing import PNG, atomic_file
from palpate.scenes.build import model_of
from palpate.scenes.scene import load_scene
from palpate.window.guide import Guide
from palpate.window.session import SessionOptions, TouchSession
from tests.shell.window.driven import Driven, as_the_ghost_says, driving
from tools.script import script

PICTURE = Path(__file__).parent.parent / "docs" / "images" / "guided-session.png"
SIZE = (1600, 1000)
"""Of the window and of the picture, pixels: each moment is drawn at twice its size."""
ARCS, STEPS = 8, 40
"""Strokes round the foot, the eye behind each, and the places of a stroke."""
BEFORE_M, STROKE_S = 0.004, 1.6


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where it goes."""
    parser.add_argument("--picture", type=Path, default=PICTURE, metavar="PNG", help="what is written")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Explore, write the picture; presses that it took, and the modulus that came out."""
    with _guided() as (driven, guide):
        moments = [_trace(driven, guide)]
        driven.until(lambda frame: guide.suggestion.kind == "press" and not driven.session.worker.busy)
        while guide.suggestion.kind == "press":
            moments[2:] = [_moment(driven)] if len(moments) > 1 else []
            if len(moments) == 1:
                moments.append(_moment(driven))
            print(guide.lines()[0], flush=True)
            as_the_ghost_says(driven, guide)
        moments.append(_moment(driven))
        state = guide.state
    rows = [np.concatenate(moments[row : row + 2], axis=1) for row in (0, 2)]
    with atomic_file(arguments.picture, PNG) as temporary:
        from matplotlib.image import imsave

        imsave(temporary, np.concatenate(rows), format="png")
    print(f"{arguments.picture}: {guide.lines()}")
    return {"presses": state.made, "young_modulus_pa": state.modulus_pa}


@contextmanager
def _guided() -> Iterator[tuple[Driven, Guide]]:
    scene = load_scene("nodule")
    with tempfile.TemporaryDirectory() as folder:

        def guided(session: TouchSession) -> Guide:
            servo, nu = session.servo, session.model.material.poisson_ratio
            instrument = Instrument(servo.tip_radius_m, servo.options.rate_hz, {"poisson_ratio": nu})
            explorer = Explorer(instrument, GoalOptions(), poisson_ratio=nu)
            return Guide(explorer, servo, session.model, session.worker, Path(folder) / "guided.csv.gz")

        options = SessionOptions(scene.renderer)
        with driving(model_of(scene), scene, options, guided=guided, size=SIZE) as driven:
            assert driven.window.guide is not None
            yield driven, driven.window.guide


def _trace(driven: Driven, guide: Guide) -> np.ndarray:
    """All round the foot, button down on the support; the picture half way."""
    base = driven.session.model.mesh.points[driven.session.model.mesh.fixed][:, :2]
    middle = base.mean(axis=0)
    away = base - middle
    angles, reach = np.arctan2(away[:, 1], away[:, 0]), np.linalg.norm(away, axis=1)
    radius = driven.session.servo.tip_radius_m

    def foot(angle: float) -> np.ndarray:
        near = np.abs(np.angle(np.exp(1j * (angles - angle)))) < 0.15
        out = reach[near].max() + 0.5 * radius + BEFORE_M
        return np.array([*(middle + out * np.array([np.cos(angle), np.sin(angle)])), 0.0])

    picture = None
    for arc in (*range(ARCS), *range(ARCS)):  # what a stroke missed, the second round finds
        if guide.suggestion.kind != "trace" or "100 %" in guide.lines()[0]:
            break
        centre = 2 * np.pi * arc / ARCS
        driven.look_from(centre)
        driven.look_down(0.6)
        way = centre + np.linspace(-0.6, 0.6, STEPS) * 2 * np.pi / ARCS
        driven.mouse_at(foot(way[0]))
        driven.wait(0.5)
        driven.button(True)
        driven.wait(0.5)
        for angle in way:
            driven.mouse_at(foot(angle))
            driven.wait(STROKE_S / STEPS)
        if picture is None and arc >= ARCS // 2 - 1:
            picture = _moment(driven)
        driven.button(False)
        driven.wait(0.5)
    assert picture is not None, "it takes more than half of the strokes to come round"
    return picture


def _moment(driven: Driven) -> np.ndarray:
    """(h, w, 3) the window as it looks now, at half its size."""
    driven.wait(0.2)
    driven.frame()
    picture = driven.picture().astype(float)
    height, width = picture.shape[0] // 2, picture.shape[1] // 2
    return picture.reshape(height, 2, width, 2, 3).mean(axis=(1, 3)).round().astype(np.uint8)


if __name__ == "__main__":
    sys.exit(script(sys.modules[__name__]))
