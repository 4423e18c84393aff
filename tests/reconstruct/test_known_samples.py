"""The paper's three samples, simulated with finite strain: moduli, intervals, and the paper's robustness."""

import numpy as np
import pytest

from palpate.mechanics.recording.recording import read_recording
from palpate.reconstruction.pipeline import Reconstruction, ReconstructOptions, reconstruct_fully
from palpate.reconstruction.steps.s7_modulus.modulus_paper import PaperOptions
from palpate.show.reconstruction.modulus import height_trends

pytestmark = pytest.mark.slow
NAMES = ("silicone-1-cylinder", "silicone-2-block", "silicone-3-halfsphere")


@pytest.fixture(scope="module")
def results(shared_recordings) -> dict[str, Reconstruction]:
    return {n: reconstruct_fully(read_recording(shared_recordings / f"{n}.toml")) for n in NAMES}


@pytest.mark.parametrize("name", NAMES)
def test_the_modulus_is_right_and_its_interval_covers(results, name):
    result = results[name]
    truth = result.exploration.recording.truth["young_modulus_pa"]
    low, high = result.model.material.young_modulus_ci95_pa
    assert result.model.material.young_modulus_pa == pytest.approx(truth, rel=0.05)
    assert low < truth < high
    assert high / low < 1.2


def test_no_press_of_the_stiff_sample_is_below_any_of_the_soft_ones(results):
    stiff, *soft = (results[n].press_modulus_pa for n in NAMES)
    assert stiff.min() > max(s.max() for s in soft)
    assert results[NAMES[1]].model.material.young_modulus_pa == pytest.approx(
        results[NAMES[2]].model.material.young_modulus_pa, rel=0.04
    )


def test_stiffness_follows_the_height_of_the_cylinder_and_the_modulus_does_not(results):
    trends = {t.name: t for t in height_trends(results[NAMES[0]].model)}
    assert trends["k_v"].pearson < -0.9 and trends["k_h"].pearson < -0.9
    # of the presses' moduli, which scatter by a percent, even a percent from foot to top correlates
    assert abs(trends["e_pa"].change) < 0.02 < 0.2 < abs(trends["k_v"].change)
    each = results[NAMES[0]].press_modulus_pa
    assert np.std(each) / np.mean(each) < 0.03


def test_the_papers_mode_separates_the_samples_too(shared_recordings):
    moduli = []
    for name in NAMES[:2]:
        options = ReconstructOptions(method="paper", paper=PaperOptions(indentation_m=0.005))
        recording = read_recording(shared_recordings / f"{name}.toml")
        moduli.append(reconstruct_fully(recording, options).model.material.young_modulus_pa)
    assert moduli[0] > 1.5 * moduli[1]
