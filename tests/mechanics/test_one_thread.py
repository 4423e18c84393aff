"""What is fitted has its linear algebra on one thread, whatever the cores; what is around it has its own."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from threadpoolctl import ThreadpoolController, threadpool_info

from palpate.diagnosis.compare.comparison import compare
from palpate.diagnosis.other_simulator.pipeline import diagnose_simulated
from palpate.diagnosis.other_simulator.tuned import tuned
from palpate.diagnosis.pipeline import diagnose
from palpate.mechanics.one_thread import one_thread
from palpate.mechanics.press_solver.solved_places import SolvedPresses
from palpate.reconstruction.pipeline import reconstruct_fully

FITS = (compare, diagnose, diagnose_simulated, reconstruct_fully, SolvedPresses.normal_force, tuned)


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


@pytest.mark.parametrize(("stated", "taken"), [({}, 1), ({"OPENBLAS_NUM_THREADS": "2"}, 2)])
def test_a_command_has_one_unless_more_are_asked_for(stated: dict[str, str], taken: int) -> None:
    code = (
        "import sys; sys.argv = ['palpate', 'devices', '--json', '-']\n"
        "from palpate.__main__ import main\n"
        "main()\n"
        "import scipy.linalg, threadpoolctl\n"
        "dense = threadpoolctl.ThreadpoolController().select(internal_api='openblas')\n"
        "print({each['num_threads'] for each in dense.info()})"
    )
    around = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    run = subprocess.run(
        [sys.executable, "-c", code], env={**around, **stated}, capture_output=True, text=True, check=True
    )
    assert run.stdout.splitlines()[-1] == str({taken})


@pytest.mark.parametrize("fits", FITS)
def test_all_that_fits_thousands_of_times_is_on_one(fits, monkeypatch: pytest.MonkeyPatch) -> None:
    counted: list[object] = []
    monkeypatch.setattr(ThreadpoolController, "select", lambda *_, **given: counted.append(given))
    with pytest.raises(AttributeError, match="limit"):
        fits()
    assert counted == [{"internal_api": "openblas"}]
