"""Ten of the zoo's meshes become a model that presses, by themselves or by the cure that a refusal names."""

from __future__ import annotations

import argparse
from types import SimpleNamespace

import numpy as np
import pytest

import palpate as pp
from benchmarks import mesh_zoo
from benchmarks._zoo_presses import places_of
from benchmarks._zoo_ticks import jumps
from benchmarks.mesh_zoo import OUTCOMES, ZOO, _cure, _judge, run, tried

TEN = (
    "prostate",
    "block of 10 mm",
    "cylinder",
    "plate of 6 mm",
    "two blocks touching",
    "dome, scanned on a table",
    "dome, inside out",
    "dome, triangles of no area",
    "dome in inches",
    "block and one hanging",
)


@pytest.mark.slow
@pytest.mark.parametrize("name", TEN)
def test_a_mesh_of_the_zoo_is_pressed_right(name, tmp_path):
    found = tried(ZOO[name](), tmp_path, sizes=1, places=1, solved=0)
    assert found["outcome"] in OUTCOMES[:2], found
    assert found["pressed"] == 1 and found["least_force_n"] > 0


def test_what_lies_under_a_place_is_the_object_and_not_the_triangle_that_it_is_in(tmp_path):
    """Most places of smooth shapes were pressed by 0.1 mm, as if the object were as thin."""
    drawn = ZOO["tongue"]()
    drawn.mesh.export(tmp_path / "tongue.stl")
    places = places_of(pp.model_of(tmp_path / "tongue.stl", unit=drawn.unit, up=drawn.up), 8)
    assert (places.thickness > 0.005).all()


def test_a_stopped_run_goes_on_where_it_was(tmp_path, monkeypatch):
    arguments = argparse.Namespace(
        only="two blocks touching", first=60, every=1, sizes=1, places=0, solved=0, ticks=0,
        work=str(tmp_path / "kept.jsonl"),
    )  # fmt: skip
    first = run(arguments)
    monkeypatch.setattr(mesh_zoo, "tried", lambda *_: pytest.fail("it was meshed again"))
    assert run(arguments)["shapes"] == first["shapes"]
    arguments.places = 1  # another setting is another run
    with pytest.raises(pytest.fail.Exception):
        run(arguments)


@pytest.mark.parametrize("most, sizes", [(20_000, 2), (100, 1)])
def test_a_mesh_is_held_against_a_finer_one_or_none(most, sizes, tmp_path, monkeypatch):
    """Where half the size took too much work a coarser mesh was judged as the finer one."""
    monkeypatch.setattr(mesh_zoo, "_MOST", most)
    made = tried(ZOO["two blocks touching"](), tmp_path, places=0)["sizes_mm"]
    assert len(made) == sizes and made[-1] <= made[0]


def test_sizes_that_differ_are_wrong_and_it_is_said_what_was_stated_there():
    found = {"outcome": "right", "wrong": [], "volume_ratio": 1.0, "places": 2, "pressed": 2, "unsettled": 0}
    found |= {"least_force_n": 1.0, "between_sizes": [0.01, -0.03], "stated_share": [0.02, 0.04]}
    _judge(found | {"over_hertz": [], "over_solver": []})
    assert found["wrong"] == ["sizes -0.030 of 0.040 stated"]


def test_a_force_that_changes_more_than_the_hand_moves_is_a_jump_and_one_that_ends_is_none():
    material = SimpleNamespace(young_modulus_pa=20e3, poisson_ratio=0.5)
    renderer, up = SimpleNamespace(model=SimpleNamespace(material=material)), np.array([0.0, 0.0, 1.0])
    path = np.array([0.0, 0.0, 1.0, 2.0, 2.0])[:, None] * 1e-4 * up
    share = jumps(renderer, 5e-3, path, np.array([1.0, 0.5, 0.55, 0.6, 0.0])[:, None] * up)
    assert share[0] == pytest.approx(0.498) and not share[1:].any()


def test_there_are_sixty():
    assert len(ZOO) == 60


@pytest.mark.parametrize(
    "said, given",
    [
        ("'a.stl' has no flat foot with +z up: cut off what settles, --sink 0.0018", {"sink_m": 0.0018}),
        ("'a' is 60 m across: these look like mm: give --unit mm", {"unit": "mm"}),
        ("'a': its flat foot is for --up=0.1,-0.2,1; or turn it", {"up": "0.1,-0.2,1"}),
        ("say --modulus 'body 1=PA', or --modulus PA, one for all", {"young_modulus_pa": 20e3}),
        (
            "turn it (--up); or leave out what hangs, --modulus 'body 2=0'",
            {"young_modulus_pa": {"body 2": 0}},
        ),
        ("it encloses no volume", None),
    ],
)
def test_the_cure_is_read_from_a_refusal(said, given):
    assert _cure(said) == given
