"""Where the gap is: the p values hold their rate of false alarms where presses share their site's errors."""

import numpy as np
import pytest
from scipy.stats import binom

from palpate.diagnosis.verdict.where import family_wise

NAMES = ("depth", "rate", "phase", "direction", "order", "repeat")
NULLS = 500


def contrasts(
    rng: np.random.Generator, repeats: int, sites: int = 12
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Six contrasts of zero mean, site: an error of the site, the press's own, and some that cannot tell."""
    site = np.tile(np.arange(sites), repeats)
    shared = rng.normal(size=(sites, len(NAMES))) * rng.uniform(0.5, 2.0, len(NAMES))
    values = shared[site] + rng.normal(scale=0.3, size=(len(site), len(NAMES)))
    values[rng.random(values.shape) < 0.1] = np.nan
    return dict(zip(NAMES, values.T, strict=True)), site


@pytest.mark.parametrize("repeats", [1, 2, 3])
def test_family_wise_false_alarms_come_at_the_stated_rate(repeats: int) -> None:
    rng = np.random.default_rng(repeats)
    alarms = sum(
        min(family_wise(*contrasts(rng, repeats), seed=null).values()) < 0.05 for null in range(NULLS)
    )
    low, high = binom.interval(0.998, NULLS, 0.05)
    assert low <= alarms <= high


def test_a_shift_that_all_sites_share_is_found_in_its_contrast_alone() -> None:
    rng = np.random.default_rng(4)
    found = []
    for seed in range(40):
        values, site = contrasts(rng, 2)
        values["rate"] = values["rate"] / np.nanstd(values["rate"]) + 2.0
        p = family_wise(values, site, seed)
        found.append([name for name in NAMES if p[name] < 0.05])
    assert np.mean(["rate" in names for names in found]) > 0.95
    assert np.mean([len(names) > 1 for names in found]) < 0.15


def test_many_presses_at_few_sites_are_no_evidence() -> None:
    rng = np.random.default_rng(5)
    values, site = contrasts(rng, 10, sites=4)
    assert set(family_wise({name: v + 5 for name, v in values.items()}, site, 0).values()) == {1.0}
