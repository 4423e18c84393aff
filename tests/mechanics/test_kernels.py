"""What is compiled for kernels alone is called by them alone: from Python the call would end the process."""

import ast
import re
from pathlib import Path

import pytest
from numba import njit
from numba.core.codegen import JitEngine

from palpate.mechanics.kernel_cache import sources
from palpate.mechanics.kernels import fresh_part

ROOT = Path(__file__).resolve().parents[2]
ALONE = {"part", "inner", "fresh_part"}
COMPILED = ALONE | {"kernel", "step_kernel", "loop_kernel", "shared_part", "njit"}


def decorators(function: ast.FunctionDef) -> set[str]:
    """Names of its decorators, called or not."""
    bare = (d.func if isinstance(d, ast.Call) else d for d in function.decorator_list)
    return {d.attr if isinstance(d, ast.Attribute) else getattr(d, "id", "") for d in bare}


def python_calls(node: ast.AST) -> set[str]:
    """Names called outside of compiled functions."""
    if isinstance(node, ast.FunctionDef) and decorators(node) & COMPILED:
        return set()
    own = {node.func.id} if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else set()
    return own.union(*(python_calls(child) for child in ast.iter_child_nodes(node)))


@pytest.fixture(scope="module")
def texts() -> dict[str, str]:
    """Dotted name -> source of everything that may call a kernel."""
    beside = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts): path
        for folder in ("benchmarks", "tests")
        for path in (ROOT / folder).rglob("*.py")
    }
    found = {**beside, **{name: Path(path) for name, path in sources().items()}}
    return {name: path.read_text(encoding="utf-8") for name, path in found.items()}


def those_with(texts: dict[str, str], pattern: str) -> dict[str, ast.Module]:
    """Of the sources those in which this is found, parsed."""
    return {module: ast.parse(text) for module, text in texts.items() if re.search(pattern, text)}


def test_what_only_kernels_call_is_made_for_the_processor_within_them_alone(monkeypatch):
    """For itself as well it is made, and optimised, for nobody."""
    made = []
    finish = JitEngine.finalize_object
    monkeypatch.setattr(JitEngine, "finalize_object", lambda self: (made.append(1), finish(self)))

    def half(x):
        return 0.5 * x

    counts = []
    for decorate in (njit, fresh_part, njit):  # the first compiles what adds numbers, too
        callee = decorate(half)
        before = len(made)
        assert njit(lambda x, callee=callee: callee(x) + callee(x + 1.0))(4.0) == 4.5
        counts.append(len(made) - before)
    _, within, beside = counts
    assert within == beside - 1


@pytest.mark.slow
def test_python_calls_nothing_that_is_compiled_for_kernels_alone(texts):
    alone = {
        (module, node.name)
        for module, tree in those_with(texts, rf"@[\w.]*\b({'|'.join(ALONE)})\b").items()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and decorators(node) & ALONE
    }
    assert ("palpate.render.fem.careful_slip", "settle") in alone
    wrong = []
    for module, tree in those_with(texts, rf"\b({'|'.join({name for _, name in alone})})\b").items():
        seen = {
            (node.module, name.name): name.asname or name.name
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom)
            for name in node.names
        }
        calls = python_calls(tree)
        wrong += [
            f"{module} calls {name} of {home}"
            for home, name in alone
            if (name if home == module else seen.get((home, name))) in calls
        ]
    # the laws of a path are made there, and handed to kernels
    assert [word for word in wrong if "effects.path" not in word] == []
