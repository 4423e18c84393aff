"""Run cases by an interpreter's installation of the program, and read what came of them."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from platformdirs import user_cache_path

from tools.goldens.cases import CASES, Case
from tools.goldens.plain import WAIT, Plain

INSIDE = Path(__file__).with_name("inside.py")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
LONGEST_S = 1500.0
"""A command that takes longer is stopped."""


class Measured:
    """One installation. python: its interpreter; folder: where cases run; model: a MODEL folder, by default
    the one of the scene `demo`, which is shipped."""

    def __init__(self, python: Path, folder: Path, model: Path | None = None) -> None:
        self.python, self.folder = python, folder.resolve()
        self.folder.mkdir(parents=True, exist_ok=True)
        self.cache = _own_cache(self.folder.with_name(f"{self.folder.name}-cache"))
        self.model = model
        places = {str(self.folder): "WORK", str(python.parent): "BIN", str(Path.home()): "HOME"}
        self.places, self.version = places, self.ask("facts")["version"]
        self.plain = Plain(places, self.version)
        self.ask("wrong", "inputs")
        self.done: dict[str, dict[str, Any]] = {}

    def record(self, case: Case) -> dict[str, Any]:
        """What a case gives, run once."""
        if not case.light and not (self.folder / "model").exists():
            self._prepare()
        if case.name not in self.done:
            self.done[case.name] = _without(self._run(case), case.without)
        return self.done[case.name]

    def _prepare(self) -> None:
        """The model, and files to read, which take some seconds."""
        shipped = Path(self.ask("shipped"))
        self.plain = Plain({**self.places, str(shipped.parents[1]): "CACHE"}, self.version)
        self.ask("inputs", "inputs")
        made = self.model or shipped
        computed = shutil.ignore_patterns("compliance-*", "places-*", "contact-*", "*.cache")
        shutil.copytree(made, self.folder / "bare", ignore=computed)
        shutil.copytree(made, self.folder / "model")

    def ask(self, what: str, *words: str, cwd: Path | None = None) -> Any:
        """What `inside` answers."""
        made = self._child([str(INSIDE), what, *words], cwd or self.folder)
        if made.returncode:
            raise RuntimeError(f"{what}: {made.stderr}")
        return json.loads(made.stdout.splitlines()[-1])

    def _run(self, case: Case) -> dict[str, Any]:
        place = self.folder / case.name
        place.mkdir()
        head: dict[str, Any] = {"near": dict(case.near)} if case.near else {}
        head |= {"left out": list(case.without)} if case.without else {}
        if case.inside:
            return head | {"answer": self.plain.tree(self.ask(*case.inside, cwd=place))}
        lines = [shlex.split(line) for line in case.lines]
        if case.together:
            todo = self.folder / f"{case.name}.todo"
            todo.write_text(json.dumps(lines), encoding="utf-8")
            ran = self.ask("commands", str(todo), cwd=place)
        else:
            ran = [self._command(words, place) for words in lines]
        runs = [
            {
                "command": " ".join(["palpate", line]).rstrip(),
                "exit": each["exit"],
                "stdout": self._out(each["stdout"]),
                "stderr": self.plain.lines(WAIT.sub("", each["stderr"])),
            }
            for line, each in zip(case.lines, ran, strict=True)
        ]
        files = sorted(p for p in place.rglob("*") if p.is_file())
        left = {str(p.relative_to(place)): p for p in files if p.suffix not in (".bin", ".npz")}
        return head | {
            "runs": runs,
            "files": {self.plain.text(n): self.plain.file(p) for n, p in left.items()},
        }

    def _out(self, text: str) -> Any:
        """Standard output line by line; what `--json -` wrote as JSON."""
        if text.startswith("{"):
            return self.plain.tree(json.loads(text))
        return self.plain.lines(text)

    def _command(self, words: list[str], place: Path) -> dict[str, Any]:
        made = self._child(["-m", "palpate", *words], place)
        return {"exit": made.returncode, "stdout": made.stdout, "stderr": made.stderr}

    def _child(self, words: list[str], place: Path) -> subprocess.CompletedProcess[str]:
        gone = ("PYTHONPATH", "PALPATE_FOLLOW_PATHS", "DISPLAY", "NUMBA_CACHE_DIR")
        kept = {k: v for k, v in os.environ.items() if k not in gone and not k.startswith("PYTEST_")}
        fixed = dict.fromkeys(_THREADS, "1") | {
            "COLUMNS": "80", "LC_ALL": "C.UTF-8", "TZ": "UTC", "PYTHONHASHSEED": "0", "MPLBACKEND": "Agg",
            "PYVISTA_OFF_SCREEN": "true", "NO_COLOR": "1", "PYTHONIOENCODING": "utf-8",
            "PALPATE_CACHE": str(self.cache),
        }  # fmt: skip
        return subprocess.run(
            [str(self.python), "-P", *words], cwd=place, env=kept | fixed, capture_output=True, text=True,
            encoding="utf-8", stdin=subprocess.DEVNULL, timeout=LONGEST_S,
        )  # fmt: skip


def _own_cache(folder: Path) -> Path:
    """A cache without models: `palpate demo` leaves one whose mesh is another than the shipped one's.
    Compiled kernels are shared with the user's, and the laboratory's meshes: the mesher makes another each
    time."""
    users = Path(os.environ.get("PALPATE_CACHE") or user_cache_path("palpate", appauthor=False)).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    for shared in ("kernels", "laboratory"):
        (users / shared).mkdir(parents=True, exist_ok=True)
        if not (folder / shared).exists():
            (folder / shared).symlink_to(users / shared, target_is_directory=True)
    return folder


def _without(value: Any, keys: tuple[str, ...]) -> Any:
    """The same without these keys, wherever they stand."""
    if isinstance(value, dict):
        return {k: _without(v, keys) for k, v in value.items() if k not in keys}
    return [_without(v, keys) for v in value] if isinstance(value, list) else value


def named(names: Iterable[str]) -> list[Case]:
    """The cases of these names; raises KeyError for another."""
    known = {case.name: case for case in CASES}
    return [known[name] for name in names]
