"""Hostile files and command lines, drawn by seed, against the commands: what is refused, accepted, or breaks.

A recording (samples or description), a MODEL folder (each of its files) or the numbers of a command line are
damaged at random (`_mutations`); `palpate check` and `palpate press` answer in a process that is watched.
Nothing may end in a traceback, in more than one line of refusal, in over a minute, in over 2 GB beyond what
the sound command takes, or silently in another force: a press of a damaged folder either says something or
gives the sound folder's force, unless it was `model.toml` that was changed, which people may edit.
"""

from __future__ import annotations

import argparse
import json
import select
import shutil
import subprocess
import tempfile
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.errors import OptionError
from mechanics.model import write_model
from mechanics.recording import read_recording, write_recording
from palpate.benchmarks._mutations import EXTREMES, MUTATIONS
from palpate.benchmarks._servo_load import block_model
from palpate.benchmarks.timing import table
from palpate.child import module_command, module_environment
from scenes.embedded import embedded_names, embedded_recording

SUMMARY = "hostile recordings, models and command lines, drawn by seed: refused, accepted, broken"
LONGEST_S, MOST_BYTES, SAME = 60.0, 2e9, 0.01
TARGETS = ("recording", "model", "options")
BROKEN = ("traceback", "many lines", "hang", "memory", "died", "silent other force")
NUMBERS = ("--depth", "--speed", "--hold", "--rate", "--tip-radius")
PRESS = ["--at", "0,0,0.03", "--direction", "0,0,-1", "--depth", "0.002", "--speed", "0.02"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How many, from which seed, at what."""
    parser.add_argument("--count", type=int, default=300, help="hostile inputs")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--target", choices=TARGETS, action="append", help="what is damaged (default: all)")
    parser.add_argument("--keep", metavar="DIR", help="keep what broke something here")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Try, print the counts and what broke."""
    from tqdm import tqdm

    targets = tuple(arguments.target or TARGETS)
    counts: Counter[tuple[str, str]] = Counter()
    broken: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory(prefix="palpate-fuzz-") as folder:
        sound = _Sound(Path(folder))
        child = _Child()
        try:
            sound.force_n = _force(child, sound.model, sound.curve)
            for seed in tqdm(range(arguments.first, arguments.first + arguments.count), disable=None):
                target = targets[seed % len(targets)]
                case = sound.damaged(target, np.random.default_rng([29, seed]), Path(folder) / "case")
                outcome, words = _judged(child, case, sound)
                counts[target, outcome] += 1
                if outcome in BROKEN:
                    broken.append({"seed": seed, "target": target, "outcome": outcome, "how": case.how,
                                   "argv": case.argv, "words": words[-400:]})  # fmt: skip
                    if arguments.keep:
                        kept = Path(arguments.keep) / f"{seed}-{target}"
                        shutil.copytree(case.folder, kept, dirs_exist_ok=True)
        finally:
            child.end()
    _print(counts, targets, broken)
    return {"count": arguments.count, "first": arguments.first, "broken": broken,
            "counts": {t: {o: n for (a, o), n in counts.items() if a == t} for t in targets}}  # fmt: skip


class _Case:
    """A damaged input: argv of the command, what was done, where it lies, the curve it may write."""

    def __init__(self, folder: Path, argv: list[str], how: str, curve: Path | None, edited: bool) -> None:
        self.folder, self.argv, self.how, self.curve, self.edited = folder, argv, how, curve, edited


class _Sound:
    """The inputs before they are damaged."""

    def __init__(self, folder: Path) -> None:
        whole = read_recording(embedded_recording(embedded_names()[0]))
        half = slice(0, len(whole.t) // 2)
        part = replace(
            whole, t=whole.t[half], position=whole.position[half], force_on_tool=whole.force_on_tool[half],
            quaternion=None if whole.quaternion is None else whole.quaternion[half],
        )  # fmt: skip
        self.recording = write_recording(folder / "sound" / "rec.csv", part)
        self.model = write_model(folder / "sound" / "MODEL", block_model(60))
        self.curve = folder / "curve.csv"
        self.force_n = np.nan

    def damaged(self, target: str, random: np.random.Generator, folder: Path) -> _Case:
        """One case, in `folder`, which is made anew."""
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        curve = folder / "curve.csv"
        if target == "options":
            name = NUMBERS[int(random.integers(len(NUMBERS)))]
            drawn = f"{10.0 ** random.uniform(-12, 12) * random.choice([1, -1]):.3g}"
            value = drawn if random.random() < 0.6 else EXTREMES[int(random.integers(len(EXTREMES)))].decode()
            argv = ["press", str(self.model), *PRESS, f"{name}={value}", "-o", str(curve)]
            return _Case(folder, argv, f"{name}={value[:20]}", None, True)
        if target == "recording":
            for file in self.recording.parent.glob("rec.*"):
                shutil.copy(file, folder / file.name)
            chosen = folder / str(random.choice(["rec.csv", "rec.toml"]))
            argv = ["check", str(folder / "rec.csv"), "--json", str(folder / "out.json")]
        else:
            shutil.copytree(self.model, folder / "MODEL")
            chosen = Path(
                str(random.choice(sorted(str(p) for p in (folder / "MODEL").iterdir() if p.is_file())))
            )
            argv = ["press", str(folder / "MODEL"), *PRESS, "-o", str(curve)]
        mutation = MUTATIONS[int(random.integers(len(MUTATIONS)))]
        chosen.write_bytes(mutation(chosen.read_bytes(), random))
        how = f"{mutation.__name__} in {chosen.name}"
        return _Case(folder, argv, how, curve if target == "model" else None, chosen.name == "model.toml")


class _Child:
    """A process that answers commands, made anew where it died or had to be ended."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None

    def ask(self, argv: list[str], longest_s: float = LONGEST_S) -> dict[str, Any]:
        """Its answer; `code` None and `ended` where it hung, grew or died."""
        process = self._running()
        assert process.stdin is not None and process.stdout is not None
        before = _resident(process.pid)
        process.stdin.write(json.dumps(argv) + "\n")
        process.stdin.flush()
        end = time.monotonic() + longest_s
        while not select.select([process.stdout], [], [], 0.05)[0]:
            grown = _resident(process.pid) - before > MOST_BYTES
            if grown or time.monotonic() > end:
                self.end()
                return {"code": None, "error": "", "traceback": "", "ended": "memory" if grown else "hang"}
        line = process.stdout.readline()
        if not line:
            self.end()
            return {"code": None, "error": "", "traceback": "", "ended": "died"}
        return {"ended": "", **json.loads(line)}

    def end(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None

    def _running(self) -> subprocess.Popen[str]:
        if self._process is None:
            self._process = subprocess.Popen(
                module_command("palpate.benchmarks._fuzz_child"), stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=module_environment(),
            )  # fmt: skip
        return self._process


def _judged(child: _Child, case: _Case, sound: _Sound) -> tuple[str, str]:
    """(outcome, words)."""
    said = child.ask(case.argv)
    lines = [x for x in said["error"].strip().splitlines() if x]
    words = said["traceback"] or said["error"]
    if said["ended"] or said["traceback"]:
        return said["ended"] or "traceback", words
    if said["code"] == 2:
        refusals = [x for x in lines if "warning:" not in x]
        return ("refused in one line" if len(refusals) == 1 else "many lines"), words
    if said["code"] == 1:
        return "grave finding", words
    if case.curve is not None and not lines and not case.edited:
        if abs(_last(case.curve) - sound.force_n) > SAME * abs(sound.force_n):
            return "silent other force", f"{_last(case.curve):.6g} N for {sound.force_n:.6g} N"
    found = case.folder / "out.json"
    if lines or (found.exists() and json.loads(found.read_text())["findings"]):
        return "accepted with a word", words
    return "accepted", words


def _force(child: _Child, model: Path, curve: Path) -> float:
    said = child.ask(["press", str(model), *PRESS, "-o", str(curve)], 600.0)  # a first time compiles
    if said["code"] != 0:
        raise OptionError(f"the sound press does not work: {said['error'] or said['traceback']}")
    return _last(curve)


def _last(curve: Path) -> float:
    """N, the greatest force along z of a curve."""
    return float(np.loadtxt(curve, delimiter=",", skiprows=1)[:, 7].max())


def _resident(pid: int) -> float:
    """Bytes in memory; 0 where the system does not say."""
    try:
        return 4096.0 * float(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except OSError:
        return 0.0


def _print(counts: Counter[tuple[str, str]], targets: tuple[str, ...], broken: list[dict[str, Any]]) -> None:
    outcomes = sorted({o for _, o in counts}, key=lambda o: (o in BROKEN, o))
    rows = [[t, *(counts[t, o] for o in outcomes), sum(counts[t, o] for o in outcomes)] for t in targets]
    print(table(["damaged", *outcomes, "tried"], rows))
    for case in broken:
        words = case["words"].strip()[-300:]
        print(f"{case['seed']} {case['target']}, {case['how']}: {case['outcome']}: {words}")
