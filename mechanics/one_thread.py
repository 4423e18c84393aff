"""Linear algebra on one thread, where matrices are small.

What is fitted thousands of times has matrices of some hundred rows. Spread over cores they take longer, most
of all beside other work: threads wait for each other at a full turn each. And sums in another order round
otherwise, so that a fit would depend on the machine's cores. The command line has one as it begins
(`palpate.__main__`), or as many as a user's own OPENBLAS_NUM_THREADS says; what fits has one wherever it is
called.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

_Given = ParamSpec("_Given")
_Result = TypeVar("_Result")


def one_thread(function: Callable[_Given, _Result]) -> Callable[_Given, _Result]:
    """The function with NumPy's and SciPy's own linear algebra on one thread while it runs; sparse
    factorisations (`mechanics.elastic.pardiso`) keep theirs."""

    @wraps(function)
    def run(*given: _Given.args, **named: _Given.kwargs) -> _Result:
        dense = ThreadpoolController().select(internal_api="openblas")
        with dense.limit(limits=1):
            return function(*given, **named)

    return run
