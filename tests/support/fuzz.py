"""Hostile files, command lines and bytes, drawn by seed, against the commands: refused, accepted, broken.

A recording, a MODEL folder, a scene, other programs' files, surfaces (each of their files, damaged by
`mutations`), the options of every command and the bytes of devices. The commands answer in one process that
is watched and goes on from case to case; one in `--strangers` runs in a process of its own, as a person runs
it. Nothing may end in a traceback, in more than one line of refusal, in over a minute of processor time, in
over 2 GB beyond what the sound command takes, in files that are left behind, or silently in another answer: a
press of a damaged folder says something or gives the sound folder's force (unless `model.toml` was changed,
which people may edit); a modulus that is off by a factor of two is never without a word.

`--interrupts N` ends long commands at N random moments in place of that (`interrupts`).
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.timing import table
from palpate.mechanics.errors import OptionError

from .fuzz_cases import SHARES, TARGETS, Case, Sound
from .fuzz_child import Child, Runner, Stranger
from .interrupts import interrupted

_COMPILES_S = 600.0
"""A sound command's first time may have to compile."""
_SAME, _ALIKE, _OFF = 0.01, 0.05, np.log(2.0)
"""Forces agree within the first, relative; moduli within the second; beyond the last is never silent."""
_CHECKED = 1
"""Exit code of a check that found something."""
ACCEPTED = ("accepted and right", "accepted with a word", "accepted, another value", "accepted")
BROKEN = ("traceback", "many lines", "hang", "memory", "died", "left behind", "silent other answer")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How many, from which seed, at what."""
    parser.add_argument("--count", type=int, default=300, help="hostile inputs (default: 300)")
    parser.add_argument("--first", type=int, default=0, help="first seed (default: 0)")
    parser.add_argument("--target", choices=TARGETS, action="append", help="what is damaged (default: all)")
    parser.add_argument("--strangers", type=int, default=10, metavar="N",
                        help="every Nth command in a process of its own (default: 10)")  # fmt: skip
    parser.add_argument("--deep", type=float, default=0.2, metavar="SHARE",
                        help="of the recordings, reconstructed, not checked only (default: 0.2)")  # fmt: skip
    parser.add_argument("--interrupts", type=int, default=0, metavar="N",
                        help="end long commands at N random moments, in place of all that")  # fmt: skip
    parser.add_argument("--command", action="append", help="with --interrupts: only this one (repeatable)")
    parser.add_argument("--minutes", type=float, default=np.inf, metavar="M",
                        help="begin no further input after that [min] (default: no limit)")  # fmt: skip
    parser.add_argument("--keep", metavar="DIR", help="keep what broke something here")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Try, print the counts and what broke."""
    if arguments.interrupts:
        return interrupted(
            arguments.interrupts, arguments.first, arguments.command, arguments.keep, arguments.minutes
        )
    if arguments.strangers < 1:
        raise OptionError(f"--strangers is {arguments.strangers}; it must be 1 or greater")
    return _fuzzed(arguments, tuple(arguments.target or TARGETS))


def _fuzzed(arguments: argparse.Namespace, targets: tuple[str, ...]) -> dict[str, Any]:
    from tqdm import tqdm

    began = time.perf_counter()
    counts: Counter[tuple[str, str]] = Counter()
    broken: list[dict[str, Any]] = []
    shares = np.array([SHARES[TARGETS.index(t)] for t in targets], dtype=float)
    with tempfile.TemporaryDirectory(prefix="palpate-fuzz-") as folder:
        sound = Sound(Path(folder), arguments.deep)
        child = Child()
        try:
            judge = _Judge(sound, child, deep="recording" in targets and arguments.deep > 0)
            for seed in tqdm(range(arguments.first, arguments.first + arguments.count), disable=None):
                if time.perf_counter() - began > 60 * arguments.minutes:
                    break
                random = np.random.default_rng([29, seed])
                target = str(random.choice(targets, p=shares / shares.sum()))
                case = sound.drawn(target, random, Path(folder) / "case")
                runner: Runner = Stranger() if seed % arguments.strangers == 0 else child
                if target == "device bytes":
                    runner = child
                outcome, words = judge.outcome(case, runner)
                counts[target, outcome] += case.many
                if outcome in BROKEN:
                    print(f"{seed} {target}, {case.how}: {outcome}", file=sys.stderr, flush=True)
                    broken.append({"seed": seed, "target": target, "outcome": outcome, "how": case.how,
                                   "argv": case.argv, "words": words[-1200:]})  # fmt: skip
                    if arguments.keep:
                        kept = Path(arguments.keep) / f"{seed}-{target.replace(' ', '-')}"
                        shutil.copytree(case.folder, kept, dirs_exist_ok=True)
        except KeyboardInterrupt:
            print("interrupted: what was tried until then", file=sys.stderr)
        finally:
            child.end()
    seconds = time.perf_counter() - began
    _print(counts, targets, broken, seconds)
    return {"count": arguments.count, "first": arguments.first, "broken": broken, "seconds": seconds,
            "counts": {t: {o: n for (a, o), n in counts.items() if a == t} for t in targets}}  # fmt: skip


class _Judge:
    """Knows the sound answers: a force, N, and a modulus, Pa."""

    def __init__(self, sound: Sound, child: Child, deep: bool) -> None:
        self._model_n = self._scene_n = self._modulus_pa = np.nan
        for argv in sound.warming():
            self._sound(child, argv)
        child.first = sound.warming()[1:]  # what is compiled is on disk by now
        self._model_n = _force(sound.folder / "curve.csv")
        self._scene_n = _force(sound.folder / "scene.csv")
        if deep:
            argv = sound.reconstruction()
            self._sound(child, argv)
            self._modulus_pa = _modulus(Path(argv[-1]))

    def _sound(self, child: Child, argv: list[str]) -> None:
        said = child.ask(argv, _COMPILES_S)
        if said["code"] != 0:
            raise OptionError(f"'palpate {' '.join(argv)}' of sound input does not work: {said}")

    def outcome(self, case: Case, runner: Runner) -> tuple[str, str]:
        """(outcome, words)."""
        said = runner.ask(list(case.argv))
        lines = [x for x in said["error"].strip().splitlines() if x and not _is_progress(x)]
        words = said["traceback"] or said["error"]
        if said["ended"] or said["traceback"]:
            return said["ended"] or "traceback", words
        left = [p for p in case.folder.rglob("*") if p.name.startswith(".palpate-")]
        left += [p for p in case.outputs if p.exists() and said["code"] == 2]
        if left:
            return "left behind", f"{[str(p) for p in left]}; {words}"
        if said["code"] == 2:
            refusals = [x for x in lines if "warning:" not in x]
            return ("refused in one line" if len(refusals) == 1 else "many lines"), words
        if said["code"] not in (0, _CHECKED):
            return "died", f"exit code {said['code']}; {words}"
        return self._accepted(case, said["code"], lines)

    def _accepted(self, case: Case, code: int, lines: list[str]) -> tuple[str, str]:
        """What an answer is worth."""
        told = bool(lines) or code == _CHECKED or _findings(case.folder / "out")
        off, most = 0.0, _ALIKE
        if case.curve is not None:
            expected = self._model_n if case.target == "model" else self._scene_n
            off, most = abs(_force(case.curve) / expected - 1), _SAME
        if case.modulus is not None:
            off = abs(float(np.log(_modulus(case.modulus) / self._modulus_pa)))
        silent = not told and not off <= (_OFF if case.edited and case.modulus is not None else most)
        if silent and not (case.edited and case.modulus is None and np.isfinite(off)):
            return "silent other answer", f"{off:.3g} off; {' '.join(lines)}"
        if told:
            return "accepted with a word", " ".join(lines)
        if case.curve is None and case.modulus is None:
            return "accepted", ""
        return ("accepted and right" if off <= most else "accepted, another value"), ""


def _findings(out: Path) -> bool:
    """Whether a check or reconstruction in `out` wrote findings."""
    for name in ("check.json", "model.json"):
        if (out / name).exists() and json.loads((out / name).read_text()).get("findings"):
            return True
    return False


def _force(curve: Path) -> float:
    """N, the greatest force along z of a curve."""
    return float(np.loadtxt(curve, delimiter=",", skiprows=1)[:, 7].max())


def _modulus(file: Path) -> float:
    """Pa."""
    return float(json.loads(file.read_text())["young_modulus_pa"])


def _is_progress(line: str) -> bool:
    return "%|" in line or "it/s]" in line


def _print(
    counts: Counter[tuple[str, str]], targets: tuple[str, ...], broken: list[dict[str, Any]], seconds: float
) -> None:
    outcomes = ["refused in one line", *ACCEPTED, *(o for o in BROKEN if any(o == b for _, b in counts))]
    named = [(t, (t,)) for t in targets] + [("all", targets)]
    rows = []
    for name, kinds in named:
        each = [sum(counts[t, o] for t in kinds) for o in outcomes]
        rows.append([name, *each, sum(each)])
    print(table(["damaged", *outcomes, "tried"], rows))
    print(f"{seconds:.0f} s, {len(broken)} broken")
    for case in broken:
        words = case["words"].strip()[-300:]
        print(f"{case['seed']} {case['target']}, {case['how']}: {case['outcome']}: {words}")
