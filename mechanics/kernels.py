"""How our kernels are compiled: on disk, dividing as C does, without counting references, each part once.

A step is handed some 90 arrays in its parameters and state. Numba counts a reference to each of them at every
call, with atomic operations that cost more than the physics; the kernels allocate nothing, so nothing is lost
where that is left out. For every compiled function it also writes code that takes these arrays out of Python
objects, and it optimises a callee again within each caller. So what only kernels call is a `part` or `inner`,
without such code and optimised in its callers alone, and a loop over a whole step calls it by a `pointer`.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from numba import njit, typeof, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.options import DefaultOptions
from numba.core.targetconfig import TargetConfig

_OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy"}
if hasattr(DefaultOptions, "_nrt"):
    _OPTIONS["_nrt"] = False
_CALLED: dict[str, Any] = {**_OPTIONS, "no_cfunc_wrapper": True}
_ALONE: dict[str, Any] = {**_CALLED, "nogil": True}


class _PartLibrary(JITCodeLibrary):
    """Code that is optimised, and made for the processor, within the kernels alone that it goes into: by
    itself as well that was 30 % of compiling a step."""

    @property
    def codegen(self) -> Any:
        return self

    def set_env(self, name: str, env: Any) -> None:
        """Nothing runs from here."""

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return 0

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def serialize_using_object_code(self) -> tuple[str, str, bytes]:
        return self.serialize_using_bitcode()


class _PartCompiler(Compiler):
    """Numba's own, into such a library."""

    def define_pipelines(self) -> Any:
        state = self.state
        state.library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        return super().define_pipelines()


_FROM_KERNELS: dict[str, Any] = {
    **_OPTIONS,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "pipeline_class": _PartCompiler,
}


def _values(self: TargetConfig) -> dict[str, Any]:
    """As numba's own, which asks for each option through a property: that was a tenth of all compiling, since
    every operator is looked up by the options under which it is compiled."""
    kind = type(self)
    if kind not in _DEFAULTS:
        _DEFAULTS[kind] = {name: option.default for name, option in kind.options.items()}
    return _DEFAULTS[kind] | self._values


_DEFAULTS: dict[type, dict[str, Any]] = {}
if hasattr(TargetConfig, "values") and "_values" in getattr(TargetConfig, "__slots__", ()):
    TargetConfig.values = _values  # type: ignore[method-assign]


def kernel(function: Any) -> Any:
    """Compile a function that works on arrays in place and allocates nothing; Python and kernels call it."""
    return njit(**_CALLED)(function)


def step_kernel(function: Any) -> Any:
    """Compile a renderer's step: a kernel of which there is a `pointer` as well."""
    return njit(**_OPTIONS)(function)


def loop_kernel(function: Any) -> Any:
    """Compile a kernel that only Python calls, and that lets other threads run meanwhile."""
    return njit(**_ALONE)(function)


def part(function: Any) -> Any:
    """Compile a piece for kernels alone (see `inner`), woven into each: its arrays need not be passed."""
    return njit(forceinline=True, **_FROM_KERNELS)(function)


def shared_part(function: Any) -> Any:
    """Compile a part that Python calls as well."""
    return njit(forceinline=True, **_CALLED)(function)


def inner(function: Any) -> Any:
    """Compile a function that only kernels call. From Python it must not be called: that ends the process."""
    return njit(**_FROM_KERNELS)(function)


def fresh_part(function: Any) -> Any:
    """A part that is made while the program runs: not kept by itself, but with the kernels that call it."""
    return njit(**{**_FROM_KERNELS, "cache": False})(function)


def pointer(step: Any, *arguments: Any) -> Any:
    """A kernel as a typed function pointer for arguments of these types; it returns nothing.

    A kernel that is handed the compiled function itself would be a new one in every process, and optimise the
    step again; behind a pointer it is compiled once for each kind of arguments and kept on disk.
    """
    return _pointer(step, types.void(*map(typeof, arguments)))


def step_type(*arguments: Any) -> Any:
    """Of the `pointer` to a kernel for arguments of these types."""
    return types.FunctionType(types.void(*map(typeof, arguments)))


@cache
def _pointer(step: Any, signature: Any) -> Any:
    """Once a process for each kind of arguments."""
    step.compile(signature.args)  # as a call does: with the return type its place on disk would be another
    return types.CompileResultWAP(step.get_compile_result(signature))


def kept(function: Any, *arguments: Any) -> Any:
    """A kernel that takes named tuples like these, from disk where that is safe.

    Numba's index of a function names the types of every call ever compiled, and cannot be read in a process
    that cannot import one of them (a script's own renderer, say); for such types it is a fresh copy.
    """
    return function if all(map(_is_ours, arguments)) else _fresh_copy(function)


def _is_ours(argument: Any) -> bool:
    return type(argument).__module__.partition(".")[0] == "palpate"


@cache
def _fresh_copy(function: Any) -> Any:
    options = {name: value for name, value in function.targetoptions.items() if name != "nopython"}
    return njit(**options)(function.py_func)
