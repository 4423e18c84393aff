"""Another simulator that is run along a recorded path: its settings, and what mends them."""

import pytest

from mechanics.errors import OptionError
from palpate.operations._simulators import mended


def test_what_mends_goes_on_top_of_what_was_asked():
    assert mended("documented", "timestep_s=0.002", "best") == ("best", "timestep_s=0.002")
    assert mended("documented", "a=1,b=2", "b=3, best") == ("best", "a=1,b=3")
    assert mended("best", "", "solref_s=0.004") == ("best", "solref_s=0.004")
    with pytest.raises(OptionError, match="--mended 'better' must be KEY=VALUE"):
        mended("best", "", "better")
