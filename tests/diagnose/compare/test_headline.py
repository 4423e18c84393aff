"""The one sentence of a comparison: who errs less, and by how much."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from palpate.diagnosis.compare.comparison import verdict


@pytest.mark.parametrize(
    ("fem_n", "said"),
    [
        (0.100, "FEM errs as much as hunt-crossley"),
        (0.097, "FEM errs as much as hunt-crossley"),
        (0.104, "FEM errs as much as hunt-crossley"),
        (0.080, "FEM errs 1.2 times less than hunt-crossley"),
        (0.130, "hunt-crossley errs 1.3 times less than FEM"),
    ],
)
def test_what_errs_alike_is_not_said_to_err_less(fem_n, said):
    """ "FEM errs 1.0 times less" stood where both err alike."""
    errors = {"fem": fem_n, "kelvin-voigt": 0.2, "hunt-crossley": 0.1}
    result = SimpleNamespace(rmse_n=errors, regions=(), presses=range(9), wins=lambda name: 3, recording=None)
    words = verdict(result)
    assert words.startswith(said) and "1.0 times" not in words


def test_forces_that_were_rendered_are_said_to_be():
    """A touch that was recorded on a model, compared, read "FEM errs 7.3 times less": than itself."""
    errors = {"fem": 0.01, "kelvin-voigt": 0.2, "hunt-crossley": 0.1}
    recording = SimpleNamespace(truth={"renderer": "fem"})
    result = SimpleNamespace(
        rmse_n=errors, regions=(), presses=range(9), wins=lambda name: 3, recording=recording
    )
    assert "not measured: FEM is held against itself" in verdict(result)
    recording.truth = {"simulator": "palpate virtual laboratory"}
    assert "rendered" not in verdict(result)
