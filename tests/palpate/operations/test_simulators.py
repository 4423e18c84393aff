"""Another simulator that is run along a recorded path: its settings, and what mends them."""

import pytest

import palpate as pp
from mechanics.errors import OptionError
from palpate.operations._simulators import mended, told


def test_what_mends_goes_on_top_of_what_was_asked():
    assert mended("documented", "timestep_s=0.002", "best") == ("best", "timestep_s=0.002")
    assert mended("documented", "a=1,b=2", "b=3, best") == ("best", "a=1,b=3")
    assert mended("best", "", "solref_s=0.004") == ("best", "solref_s=0.004")
    with pytest.raises(OptionError, match="--mended 'better' must be KEY=VALUE"):
        mended("best", "", "better")


def test_a_long_run_says_how_long_and_what_fewer_presses_take():
    assert told(1200.0, 12) == "about 20 min in all; --presses 6 takes 10"
    assert told(30.0, 12) == "about 0.5 min in all" and "--presses" not in told(1200.0, 6)


@pytest.mark.slow
def test_another_simulator_is_set_beside_the_models_over_every_press(folder, recording):
    """Its modulus is fitted in each fold, as ours is: the recorded block is 1.25 times as stiff."""
    pytest.importorskip("skfem")
    found = pp.compare(recording, folder, renderer="scikit-fem", progress=False)
    print(found)
    assert 0
