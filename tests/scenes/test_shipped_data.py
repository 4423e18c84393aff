"""The models that come with the program are what it makes today.

Where one of these fails, run `python -m tools.shipped_models` and commit what it writes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from palpate.mechanics.compliance.sites import LoadPatch, touch_sites, touch_solver
from palpate.mechanics.compliance.stored_compliance import compliance_file, compliance_key, load_or_condense
from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import read_recording
from palpate.reconstruction.pipeline import reconstruct
from palpate.render.fem.renderer import FemRenderer
from palpate.render.surface.felt_surface import PRESSES, felt_surface, with_own_stiffness
from palpate.scenes import shipped
from palpate.scenes.build import model_of
from palpate.scenes.embedded import embedded_recording
from palpate.scenes.kept import folder_name
from palpate.scenes.scene import load_scene
from tools.shipped_models import SHIPPED

MAKE = (
    "what is shipped is not what is made today: run 'python -m tools.shipped_models', commit what it writes"
)
MOST_BYTES = 10_000_000


@pytest.fixture(
    scope="module",
    params=[pytest.param(name, marks=[pytest.mark.slow] * (name != "demo")) for name in SHIPPED],
)
def model(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Model:
    """A shipped model as a first touch opens it, its scene's content unchanged."""
    scene = load_scene(request.param)
    assert shipped.shipped_model(folder_name(scene)) is not None, MAKE
    return model_of(scene, cache=tmp_path_factory.mktemp("first"))


def test_each_scene_has_one_archive_and_all_are_small() -> None:
    archives = list(shipped.FOLDER.iterdir())
    assert len(archives) == len(SHIPPED), MAKE
    assert sum(path.stat().st_size for path in archives) < MOST_BYTES


def test_nothing_is_computed_for_a_first_touch(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object, **__: object) -> None:
        raise AssertionError(MAKE)

    assert model.path is not None
    assert (model.path / compliance_file(compliance_key(model))).is_file(), MAKE
    monkeypatch.setattr("palpate.mechanics.compliance.stored_compliance.surface_compliance", none)
    monkeypatch.setattr("palpate.render.surface.felt_surface.local_stiffness", none)
    assert felt_surface(model).stiffness_from == PRESSES, MAKE
    with_own_stiffness(FemRenderer(model))


@pytest.mark.slow
def test_places_give_as_they_would_if_they_were_solved_today(model: Model) -> None:
    compliance = load_or_condense(model)
    points, normals = compliance.own_points, compliance.own_normals
    height = model.support.height(points)
    # the top, half way up, and over what is inside: away from the rims, which only a touch knows of
    chosen = [
        int(height.argmax()),
        *(int(np.abs(height - share * height.max()).argmin()) for share in (0.5, 0.6)),
    ]
    nu, balls = model.material.poisson_ratio, tuple(model.material.inclusions.values())
    chosen += [int(np.linalg.norm(points - ball.centre_m, axis=1).argmin()) for ball in balls]
    solver = touch_solver(model.mesh, nu, model.surface_ratio, balls=balls)
    patch = LoadPatch(tip_radius_m=model.tool.tip_radius_m, balls=bool(balls))
    solved = touch_sites(model.mesh, points[chosen], normals[chosen], nu, solver=solver, patch=patch)
    kept = compliance.far_at(points[chosen], normals[chosen])
    whole = np.einsum("ka,kab,kb->k", normals[chosen], compliance.own[chosen], normals[chosen])
    off = np.einsum("ka,kab,kb->k", normals[chosen], kept - solved.far, normals[chosen])
    assert np.abs(off / whole).max() < 3e-3, MAKE


@pytest.mark.slow
def test_the_demo_is_what_the_recording_says_today(tmp_path: Path) -> None:
    """Mesh and all are made anew, so the modulus may move by what another mesh moves it."""
    kept = model_of(load_scene("demo"), cache=tmp_path)
    made = reconstruct(read_recording(embedded_recording()))
    moduli = [each.material.young_modulus_pa for each in (kept, made)]
    assert moduli[0] == pytest.approx(moduli[1], rel=3e-3), MAKE
    assert len(kept.presses) == len(made.presses), MAKE
    assert np.abs(kept.presses.free_air - made.presses.free_air).max() < 1e-6
