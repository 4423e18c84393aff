"""The modulus over hypotheses: one that none of them moves is the plain one, interval and all."""

from types import SimpleNamespace

import numpy as np
import pytest

from palpate.diagnosis.explore.causes import NONE, Causes
from palpate.diagnosis.explore.modulus import modulus_beside

PLAIN = SimpleNamespace(modulus_pa=20e3, ci95_pa=(20e3 * np.exp(-0.1), 20e3 * np.exp(0.1)))


@pytest.mark.parametrize("inclusion", [-20.0, 0.0, 20.0])
def test_hypotheses_that_leave_the_presses_as_they_are_leave_the_modulus(inclusion):
    causes = Causes({NONE: 0.0, "inclusion": inclusion}, 0.01, 1.0)
    modulus, interval = modulus_beside(SimpleNamespace(fit=PLAIN), None, causes)
    assert modulus == pytest.approx(PLAIN.modulus_pa, rel=1e-6)
    assert interval == pytest.approx(PLAIN.ci95_pa, rel=1e-3)


def test_where_nothing_can_be_told_nothing_is_made_up():
    unknown = SimpleNamespace(modulus_pa=np.nan, ci95_pa=(np.nan, np.nan))
    causes = Causes({NONE: 0.0}, 0.01, 1.0)
    modulus, interval = modulus_beside(SimpleNamespace(fit=unknown), None, causes)
    assert np.isnan(modulus) and np.isnan(interval).all()
