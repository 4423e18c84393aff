"""What is fitted has its linear algebra on one thread, whatever the cores; what is around it has its own."""

from __future__ import annotations

import pytest
from threadpoolctl import ThreadpoolController, threadpool_info

from palpate.diagnosis.compare.comparison import compare
from palpate.diagnosis.other_simulator import tuned
from palpate.diagnosis.other_simulator.pipeline import diagnose_simulated
from palpate.diagnosis.pipeline import diagnose
from palpate.mechanics.one_thread import one_thread
from palpate.reconstruction.pipeline import reconstruct_fully


def threads() -> list[int]:
    return [each["num_threads"] for each in threadpool_info() if each["internal_api"] == "openblas"]


def test_dense_algebra_has_one_thread_while_it_runs_and_its_own_again_after_an_error() -> None:
    @one_thread
    def seen(fails: bool) -> list[int]:
        if fails:
            raise ArithmeticError(threads())
        return threads()

    with ThreadpoolController().limit(limits=2):
        before = threads()
        assert before and min(before) == 2
        assert set(seen(False)) == {1}
        assert threads() == before
        with pytest.raises(ArithmeticError, match="1"):
            seen(True)
        assert threads() == before


@pytest.mark.parametrize("fits", [compare, diagnose, diagnose_simulated, reconstruct_fully, tuned.tuned])
def test_all_that_fits_thousands_of_times_is_on_one(fits, monkeypatch: pytest.MonkeyPatch) -> None:
    counted: list[object] = []
    monkeypatch.setattr(ThreadpoolController, "select", lambda *_, **given: counted.append(given))
    with pytest.raises(AttributeError, match="limit"):
        fits()
    assert counted == [{"internal_api": "openblas"}]
