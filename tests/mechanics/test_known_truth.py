"""Forces where the truth is known: on meshes of any size, on recordings of known shape and modulus, and as a
dragged tip feels them."""

from __future__ import annotations

import argparse
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from ..support import drag, large_presses, mesh_independence, touch_model


def run(module: ModuleType, *words: str) -> dict[str, Any]:
    parser = argparse.ArgumentParser()
    module.add_arguments(parser)
    return dict(module.run(parser.parse_args(words)))


@pytest.mark.slow
def test_the_force_of_a_press_does_not_depend_on_the_mesh():
    found = run(mesh_independence, "--sample", "cylinder", "--mesh-size", "0.010", "0.007")
    assert np.median(found["cylinder"]["change"]) < 0.02
    assert found["cylinder"]["change"].max() < 0.03


@pytest.mark.slow
def test_forces_on_true_shapes_of_true_modulus_are_the_recorded_ones(shared_recordings):
    """Nothing is fitted: within 2 % of the force, and twice the noise, by the finite-strain dent."""
    found = run(touch_model, "--recordings", str(shared_recordings))
    own = {name: row for name, row in found.items() if name.endswith("neo-hookean, refined")}
    assert len(own) == 3
    for row in own.values():
        assert row["best_factor"] == pytest.approx(1.0, abs=0.02)
        assert row["rms_n"] < 2 * np.sqrt(3) * 0.012


@pytest.mark.slow
def test_a_deep_press_is_that_of_a_whole_body_at_finite_strain():
    """Another solver, far field and all: rendered with the finite-strain dent within 5 %."""
    (row,) = run(large_presses, "--places", "1", "--deepest", "4", "--step", "0.5").values()
    ratio = np.array(row["dent_laws"]["neo-hookean"]) / row["laboratory"]["neo-hookean"]
    deep = np.array(row["depths_mm"]) >= 2.0
    assert ratio[deep] == pytest.approx(np.ones(deep.sum()), abs=0.05)


@pytest.mark.release
def test_a_dragged_press_feels_no_spots_that_a_finger_could_tell_apart():
    found = run(drag, "--scene", "nodule")
    assert len(found) == 3
    assert max(row["ripple_most"] for row in found.values()) < drag.TOLD_APART
