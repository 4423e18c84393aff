"""The model confidence set keeps what cannot be told apart and drops what is plainly worse."""

import numpy as np

from palpate.diagnosis.search.rivals import confidence_p


def test_equal_explanations_stay_and_a_worse_one_goes() -> None:
    rng = np.random.default_rng(3)
    hard = rng.gamma(2.0, 3.0, size=30)  # some sites are harder than others, for every explanation
    losses = np.stack(
        [hard + rng.normal(0, 1, 30), hard + rng.normal(0, 1, 30), hard + 3 + rng.normal(0, 1, 30)]
    )
    p = confidence_p(losses, rng)
    assert p[2] < 0.01
    assert p[:2].min() > 0.1
    assert p.max() == 1.0


def test_one_site_alone_does_not_tell_explanations_apart() -> None:
    rng = np.random.default_rng(4)
    losses = rng.normal(0, 0.1, size=(2, 24))
    losses[1, 5] += 100.0
    assert confidence_p(losses, rng).min() > 0.1


def test_the_set_covers_the_best_as_often_as_it_says() -> None:
    """Two explanations of equal expectation: each leaves the 90 % set in about 10 % of samples at most."""
    rng = np.random.default_rng(5)
    out = [confidence_p(rng.normal(size=(2, 30)), rng, 400)[0] <= 0.1 for _ in range(300)]
    assert np.mean(out) < 0.12
