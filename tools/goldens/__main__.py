"""`python -m tools.goldens`: write what the program does, or compare two such folders."""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from tools.goldens import __doc__ as about
from tools.goldens.cases import CASES
from tools.goldens.difference import Tolerance, differences, words_alone
from tools.goldens.measure import Measured, named

SHOWN = 40
"""Differing lines of one case that are printed."""


def main() -> int:
    """Exit code 1 where something differs, 2 for bad arguments."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.goldens",
        description=about,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    todo = parser.add_subparsers(dest="todo", required=True)
    write = todo.add_parser("write", help="run the cases and write one file a case")
    write.add_argument("folder", type=Path, metavar="DIR")
    write.add_argument("--only", nargs="+", default=[], metavar="NAME", choices=[c.name for c in CASES])
    write.add_argument("--quick", action="store_true", help="the quick set alone")
    write.add_argument("--words", action="store_true", help="as committed: no exact bytes, numbers rounded")
    write.add_argument("--python", type=Path, default=Path(sys.executable), help="whose installation")
    write.add_argument("--model", type=Path, help="a MODEL folder (default: the scene demo's)")
    compare = todo.add_parser("compare", help="print what differs; exit 1 where anything does")
    compare.add_argument("old", type=Path)
    compare.add_argument("new", type=Path)
    compare.add_argument("--bits", action="store_true", help="to the last bit: both of one machine")
    asked = parser.parse_args()
    if asked.todo == "compare":
        exact = Tolerance(rel=0.0, abs=0.0, bits=True)
        return compared(asked.old, asked.new, exact if asked.bits else Tolerance())
    return written(asked)


def written(asked: argparse.Namespace) -> int:
    """Run, and write."""
    chosen = named(asked.only) or [c for c in CASES if c.light or c.quick or not asked.quick]
    chosen.sort(key=lambda case: (not case.light, not case.quick))
    asked.folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="goldens-") as folder:
        begun = time.monotonic()
        # a path is not resolved: a virtual environment is known by where its interpreter is called
        measured = Measured(Path(os.path.abspath(asked.python)), Path(folder) / "work", asked.model)
        for case in chosen:
            before = _cpu()
            record = measured.record(case)
            text = json.dumps(words_alone(record) if asked.words else record, indent=1, ensure_ascii=False)
            (asked.folder / f"{case.name}.json").write_text(text + "\n", encoding="utf-8")
            print(f"{case.name:18s} {_cpu() - before:6.1f} s of processor time", flush=True)
        print(f"{_cpu():.0f} s of processor time, {time.monotonic() - begun:.0f} s")
    return 0


def _cpu() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def compared(old: Path, new: Path, tolerance: Tolerance) -> int:
    """Print what differs of the cases that both hold, and which one lacks."""
    sides = [{path.stem: path for path in sorted(folder.glob("*.json"))} for folder in (old, new)]
    bad = 0
    for name in sorted({*sides[0], *sides[1]}):
        if name not in sides[0] or name not in sides[1]:
            print(f"{name}: only in {old if name in sides[0] else new}")
            bad += name not in sides[0]  # a part may be compared with the whole
            continue
        found = case_differences(_read(sides[0][name]), _read(sides[1][name]), tolerance)
        if found:
            print(f"{name}: {len(found)} lines differ")
            print("\n".join(f"    {line}" for line in found[:SHOWN]))
            bad += 1
    print(f"{len(sides[0])} and {len(sides[1])} cases, {bad} differ")
    return int(bad > 0)


def case_differences(old: dict[str, Any], new: dict[str, Any], tolerance: Tolerance) -> list[str]:
    """What differs, by the tolerance that the case states."""
    near = {**old.get("near", {}), **new.get("near", {})}
    fields = {**vars(tolerance), "near": near}
    return list(differences(old, new, Tolerance(**fields)))


def _read(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    sys.exit(main())
