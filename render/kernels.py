"""How the kernels of the 1 kHz loop are compiled: on disk, dividing as C does, without counting references.

A step is handed some 90 arrays in its parameters and state. Numba counts a reference to each of them at every
call, with atomic operations that cost more than the physics; the kernels allocate nothing, so nothing is lost
where that is left out. Parts are woven into the kernel that calls them: their arrays need not be passed.
"""

from __future__ import annotations

from typing import Any

from numba import njit
from numba.core.options import DefaultOptions

_UNCOUNTED: dict[str, Any] = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}


def kernel(function: Any) -> Any:
    """Compile a function that works on arrays in place and allocates nothing."""
    return njit(cache=True, error_model="numpy", **_UNCOUNTED)(function)


def part(function: Any) -> Any:
    """Compile a piece of such a kernel, to be woven into it."""
    return njit(cache=True, error_model="numpy", forceinline=True, **_UNCOUNTED)(function)
