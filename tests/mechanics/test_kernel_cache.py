"""Compiled kernels follow their sources."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

from mechanics import kernel_cache

REPOSITORY = Path(kernel_cache.__file__).resolve().parents[1]


def folder_of(code: str, home: Path, **more: str) -> str:
    environment = {k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "PYTHONPATH")}
    environment |= {"XDG_CACHE_HOME": str(home), "PYTHONPATH": str(REPOSITORY), **more}
    code = "from mechanics.kernel_cache import use_own_folder\n" + code
    run = [sys.executable, "-c", code + "\nimport numba; print(numba.config.CACHE_DIR)"]
    return subprocess.run(run, env=environment, capture_output=True, text=True, check=True).stdout.strip()


def test_every_process_uses_the_folder_of_its_sources(tmp_path):
    expected = str(tmp_path / "palpate" / "kernels" / kernel_cache.sources_key(REPOSITORY))
    assert folder_of("use_own_folder()", tmp_path) == expected
    assert folder_of("import numba; use_own_folder()", tmp_path) == expected
    other = str(tmp_path / "palpate" / "kernels" / "0123")
    assert folder_of("use_own_folder()", tmp_path, NUMBA_CACHE_DIR=other) == expected  # an older parent's
    assert folder_of("use_own_folder()", tmp_path, NUMBA_CACHE_DIR="/elsewhere") == "/elsewhere"


def test_a_home_that_cannot_be_written_is_no_error(tmp_path):
    (tmp_path / "palpate").write_text("a file where a folder should be")
    assert folder_of("use_own_folder()", tmp_path) == ""


def test_the_key_follows_files_with_kernels(tmp_path):
    (tmp_path / "render").mkdir()
    kernel, other = tmp_path / "render" / "kernel.py", tmp_path / "render" / "plain.py"
    kernel.write_text("from numba import njit\n")
    key = kernel_cache.sources_key(tmp_path)
    other.write_text("A = 1\n")
    assert kernel_cache.sources_key(tmp_path) == key
    kernel.write_text("from numba import njit\nA = 2\n")
    assert kernel_cache.sources_key(tmp_path) != key


def test_old_folders_are_cleared(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    root = kernel_cache.cache_root()
    for i in range(9):
        (root / f"old{i}").mkdir(parents=True)
        os.utime(root / f"old{i}", (1000 + i, 1000 + i))
    import numba

    monkeypatch.setattr(numba.config, "CACHE_DIR", numba.config.CACHE_DIR)
    kernel_cache.use_own_folder()
    left = sorted(path.name for path in root.iterdir())
    assert left == sorted(
        ["old3", "old4", "old5", "old6", "old7", "old8", kernel_cache.sources_key(REPOSITORY)]
    )


def kernels(tree: ast.Module) -> list[ast.FunctionDef]:
    return [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and any("njit" in ast.unparse(d) for d in node.decorator_list)
    ]


def test_what_a_kernel_imports_from_our_rooms_counts_for_the_key():
    counted = kernel_cache.kernel_sources(REPOSITORY)
    for path in counted:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        used = {n.id for kernel in kernels(tree) for n in ast.walk(kernel) if isinstance(n, ast.Name)}
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in kernel_cache.ROOMS:
                if used & {alias.asname or alias.name for alias in node.names}:
                    source = REPOSITORY / (node.module.replace(".", "/") + ".py")
                    assert source in counted, f"{path} takes a number from {node.module}"
    assert REPOSITORY / "palpate" / "servo" / "layout.py" in counted  # lends numbers, holds no kernel
