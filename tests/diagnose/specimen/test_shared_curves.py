"""Curves of machines that nobody here had tried, with the right answer in their notes."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from palpate.diagnosis.specimen.bench import MachineCycle
from palpate.diagnosis.specimen.material import material_of
from palpate.diagnosis.specimen.result import MachineTests
from palpate.mechanics.contact.tip import Tip

FOLDER = Path(os.environ.get("PALPATE_SHARED", Path(__file__).parents[4] / "shared")) / "strangers"


@pytest.mark.parametrize("name", ["tilt_none", "tilt_slope", "jkr_10kPa"])
def test_the_interval_holds_ten_kilopascals(name):
    path = FOLDER / f"{name}.csv"
    if not path.is_file():
        pytest.skip("the curves are not beside the checkout (set PALPATE_SHARED)")
    t, travel_mm, load_mn = np.genfromtxt(path, delimiter=",", skip_header=1).T
    curve = MachineCycle(t, 1e-3 * travel_mm, 1e-3 * load_mn, name)
    made = material_of(MachineTests("indentation", curves=(curve,), tip=Tip("sphere", 1e-3)), [name])
    low, high = made.young_modulus_ci95_pa
    assert low <= 10e3 <= high and high < 1.25 * low
    assert abs(float(made.verdict.split(" % of the work")[0].split()[-1])) <= 2
