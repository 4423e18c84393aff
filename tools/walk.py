"""How a reader walks through the code with one command: each file once, where it is first entered.

A file is entered by the first call of one of its functions; what runs while a module is loaded is no step. A
room is a folder, and the walk comes back to it where it enters another of its files after it has left it.

    python -m tools.walk palpate reconstruct silicone-1 -o MODEL
"""

from __future__ import annotations

import argparse
import sys
import threading
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import groupby
from types import FrameType
from typing import Any

from palpate import cli
from palpate.mechanics.kernel_cache import sources
from tools.script import script

_OF_FUNCTIONS = 0x1  # code flag: bodies of modules and classes lack it


class Walk:
    """The files of ours that are entered, in order, by a command that runs inside."""

    def __init__(self) -> None:
        self.files: dict[str, str] = {}
        """Dotted name -> the function by which it was entered."""
        self._names = {path: name for name, path in sources().items()}
        self._loading: Counter[int] = Counter()

    def __enter__(self) -> Walk:
        threading.setprofile(self._see)
        sys.setprofile(self._see)
        return self

    def __exit__(self, *error: object) -> None:
        sys.setprofile(None)
        threading.setprofile(None)

    def _see(self, frame: FrameType, event: str, _: Any) -> None:
        if event not in ("call", "return"):
            return
        code = frame.f_code
        if code.co_name == "_find_and_load" and "importlib" in code.co_filename:
            self._loading[threading.get_ident()] += 1 if event == "call" else -1
        elif event == "call" and code.co_flags & _OF_FUNCTIONS and code.co_filename in self._names:
            if not self._loading[threading.get_ident()]:
                self.files.setdefault(self._names[code.co_filename], code.co_name)


def stretches(files: Iterable[str]) -> list[tuple[str, list[str]]]:
    """(room, the files that are entered there before it is left), in order."""
    return [(room, list(own)) for room, own in groupby(files, _room)]


def _room(module: str) -> str:
    return module.rpartition(".")[0]


def returns(files: Iterable[str]) -> Counter[str]:
    """How often the walk comes back to each room that it has left."""
    visits = Counter(room for room, _ in stretches(files))
    return Counter({room: count - 1 for room, count in visits.items() if count > 1})


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Of `python -m tools.walk`."""
    parser.add_argument("command", nargs=argparse.REMAINDER, help="palpate and its words")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Run the command, print its walk."""
    words: Sequence[str] = arguments.command
    with Walk() as walk:
        code = cli.main(words[words[:1] == ["palpate"] :])
    back = returns(walk.files)
    for room, own in stretches(walk.files):
        print(f"{room}  " + "  ".join(f"{file.rpartition('.')[2]}:{walk.files[file]}" for file in own))
    print(f"{len(walk.files)} files in {len(set(map(_room, walk.files)))} rooms")
    print(f"{back.total()} returns; more than twice: ", end="")
    print(", ".join(f"{room} {count}" for room, count in back.most_common() if count > 2) or "none")
    return {"files": list(walk.files), "returns": dict(back), "exit_code": code}


if __name__ == "__main__":
    sys.exit(script(sys.modules["__main__"]))
