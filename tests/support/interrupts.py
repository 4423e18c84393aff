"""Long commands ended at random moments: Ctrl-C, SIGTERM, SIGKILL, a disk full or failing from then on.

Each command runs once whole; its results are what stands there when it runs again and is ended. Afterwards
every result is the one of before or a whole new one, no temporary file or folder is left (after SIGKILL: once
the next command has run), no process is, and nothing but a line or two was said. Results and scratch files
lie on a small disk in memory, which a filler takes whole at that moment (ENOSPC); where this user may mount
none, that end is left out. A failing write is a limit on the size of files (prlimit, EFBIG), set on the
running process and all that it started.
"""

from __future__ import annotations

import contextlib
import gzip
import hashlib
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from benchmarks.timing import table
from palpate.child import module_command
from palpate.mechanics.disk.scratch import temporary_prefix
from palpate.mechanics.errors import OptionError, PalpateError
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.recording.files import recording_files
from palpate.mechanics.recording.recording import read_recording, write_recording
from palpate.scenes.embedded import embedded_names, embedded_recording

from .fuzz_cases import PRESS, cube
from .small_disk import SmallDisk

FULL, FAILING = "full disk", "failing write"
HOW = ("SIGINT", "SIGTERM", "SIGKILL", FULL, FAILING)
CODES = {"SIGINT": (130, -2), "SIGTERM": (143, -15), "SIGKILL": (-9,), FULL: (2,), FAILING: (2,)}
"""Exit codes of a command that was ended so; 0 where it was done before, or wrote nothing any more."""
LINES = 3
"""Of standard error at most, progress left out."""
FAILS_AFTER_BYTES = 4096
_DISK_BYTES = 256 << 20
_ENDS_S = 60.0
_WHOLE_S = 900.0
_ORPHANS_S = 10.0
_PROGRESS = ("%|", "it/s", "s/it")


@dataclass(frozen=True)
class Job:
    """A command and whether its moments are worth as much as those of another."""

    argv: tuple[str, ...]
    weight: float = 1.0


def _jobs(sound: Path, out: Path) -> dict[str, Job]:
    """By name; sound: where `_sound` put its files."""
    samples, description = recording_files(embedded_recording(embedded_names()[0]))
    recording, folder, file = str(description), str(sound / "block"), lambda end: str(out / end)
    return {
        "press": Job(("press", folder, *PRESS, "-o", file("curve.csv"), "--json", file("press.json"))),
        "replay": Job(("replay", folder, recording, "-o", file("forces.csv"))),
        "touch": Job(("touch", folder, "--headless", "--seconds", "3", "--record", file("session.csv.gz"))),
        "check": Job(("check", recording, "--report", file("check.html"), "--json", file("check.json"))),
        "import": Job(("import", str(samples), "-o", file("imported.csv"), "--tip-radius", "0.005")),
        "export": Job(("export", folder, "--to", "stl", "-o", file("block.stl"))),
        "reconstruct": Job(("reconstruct", recording, "-o", file("model"), "--mesh-size", "0.012",
                            "--report", file("figures.html")), 2.0),
        "compare": Job(("compare", recording, "--model", folder, "-o", file("compare.html"))),
        "simulate": Job(("simulate", "block", "-o", file("simulated.csv.gz"), "--presses", "2", "--finest",
                         "6", "--workers", "1", "--no-sizes"), 2.0),
        "diagnose": Job(("diagnose", recording, "--fast", "--apply", file("improved"), "--report",
                         file("diagnose.html")), 2.0),
        "batch": Job(("batch", recording, "-o", file("batch"), "--do", "reconstruct", "--workers", "1",
                      "--set", "reconstruct.mesh_size_m=0.012"), 2.0),
        "bench": Job(("bench", "one-d", "--json", file("one-d.json"))),
        "model": Job(("model", str(sound / "block.stl"), "-o", file("made"), "--mesh-size", "0.008")),
        "material": Job(("material", *(str(sound / f"dent-{k}.csv") for k in range(3)), "--kind",
                         "indentation", "--tip-radius", "0.005", "--fast", "--json", file("material.json"))),
        "calibrate": Job(("calibrate", recording, "--modulus", "29e3", "-o", file("tool.toml"))),
        "explore": Job(("explore", "--phantom", "dome", "-o", file("explored.csv.gz"), "--most", "4"), 2.0),
        "changes": Job(("compare", recording, str(sound / "again.csv"), "--no-diagnosis", "--json",
                        file("changes.json"))),
        "demo": Job(("demo", "-o", file("demo"), "--no-window", "--no-diagnosis", "--seconds", "2")),
    }  # fmt: skip


COMMANDS = tuple(_jobs(Path(), Path()))


def _sound(folder: Path) -> None:
    """What the commands read beside the embedded recording: a MODEL, its surface, a recording, dents."""
    import trimesh

    folder.mkdir()
    block = cube()
    write_model(folder / "block", block)
    corners = block.mesh.surface[:, :3]
    trimesh.Trimesh(block.mesh.points, corners).export(folder / "block.stl")
    once = read_recording(embedded_recording(embedded_names()[0]))
    stronger = replace(once, force_on_tool=1.2 * once.force_on_tool, object_name="again")
    write_recording(folder / "again.csv", stronger)
    t = np.linspace(0.0, 4.0, 2001)
    depth = 0.002 * (1 - np.abs(t / 2 - 1))
    for k in range(3):
        force = (1 + 0.05 * k) * 4 / 3 * 20e3 / (1 - 0.49**2) * np.sqrt(0.005) * depth**1.5
        table = np.column_stack([t, -depth, force])
        np.savetxt(folder / f"dent-{k}.csv", table, delimiter=",", header="t,z,fz", comments="")


def interrupted(
    count: int, first: int, only: list[str] | None, keep: str | None, minutes: float = np.inf
) -> dict[str, Any]:
    """End commands at `count` moments drawn from seed `first` on, none after `minutes`; print and return what
    was seen."""
    from tqdm import tqdm

    names = tuple(only or COMMANDS)
    if unknown := [name for name in names if name not in COMMANDS]:
        raise OptionError(f"--command is {unknown[0]}; allowed are {', '.join(COMMANDS)}")
    began = time.perf_counter()
    tried: Counter[tuple[str, str]] = Counter()
    broken: list[dict[str, Any]] = []
    whole_s: dict[str, float] = {}
    with _Place.made() as place:
        ends = HOW if place.disk.mounted else tuple(how for how in HOW if how != FULL)
        weights = np.array([place.jobs[name].weight for name in names])
        for seed in tqdm(range(first, first + count), desc="ended", disable=None):
            if time.perf_counter() - began > 60 * minutes:
                break
            random = np.random.default_rng([37, seed])
            name, how = str(random.choice(names, p=weights / weights.sum())), ends[seed % len(ends)]
            share = float(random.random())
            try:
                if name not in whole_s:
                    whole_s[name] = place.whole(name)
                after_s = 0.03 + share * (whole_s[name] - 0.03)
                wrong = place.ended(name, how, after_s)
            except KeyboardInterrupt:
                print("interrupted: what was tried until then", file=sys.stderr)
                break
            print(f"{seed} {name}, {how} after {after_s:.1f} of {whole_s[name]:.1f} s: "
                  f"{'; '.join(wrong) or 'well'}", file=sys.stderr, flush=True)  # fmt: skip
            tried[name, how] += 1
            if wrong:
                broken.append({"seed": seed, "command": name, "how": how, "after_s": after_s, "wrong": wrong})
                if keep:
                    shutil.copytree(place.out, Path(keep) / f"{seed}-{name}", dirs_exist_ok=True)
    seconds = time.perf_counter() - began
    names = tuple(name for name in names if name in whole_s)
    rows = [[n, f"{whole_s[n]:.1f}", *(tried[n, h] for h in HOW), sum(b["command"] == n for b in broken)]
            for n in names]  # fmt: skip
    rows.append(["all", "", *(sum(tried[n, h] for n in names) for h in HOW), len(broken)])
    print(table(["command", "whole [s]", *HOW, "broken"], rows))
    for case in broken:
        print(f"{case['seed']} {case['command']}, {case['how']} after {case['after_s']:.2f} s: "
              + "; ".join(case["wrong"]))  # fmt: skip
    print(f"{seconds:.0f} s")
    return {"count": count, "first": first, "seconds": seconds, "whole_s": whole_s, "broken": broken,
            "tried": {name: {how: tried[name, how] for how in HOW} for name in names}}  # fmt: skip


class _Place:
    """Where the commands run: results and scratch files on a small disk, sound files and the results of whole
    runs beside it."""

    def __init__(self, folder: Path) -> None:
        self.disk = SmallDisk(folder / "disk", _DISK_BYTES)
        self.out, self.scratch = self.disk.folder / "out", self.disk.folder / "scratch"
        self.kept = folder / "kept"
        for each in (self.out, self.scratch, self.kept):
            each.mkdir()
        _sound(folder / "sound")
        self.model = folder / "sound" / "block"
        self.jobs = _jobs(folder / "sound", self.out)
        self._environment = dict(os.environ, TMPDIR=str(self.scratch))

    @classmethod
    @contextlib.contextmanager
    def made(cls) -> Iterator[_Place]:
        """One in a temporary folder, which is gone afterwards."""
        with tempfile.TemporaryDirectory(prefix="palpate-ends-") as folder:
            place = cls(Path(folder))
            try:
                yield place
            finally:
                place.disk.end()

    def whole(self, name: str) -> float:
        """Run a command whole; s."""
        began = time.monotonic()
        process, said = self._begun(name)
        code, text = _waited(process, _WHOLE_S), _text(said)
        if code not in (0, 1):
            raise OptionError(f"'palpate {' '.join(self.jobs[name].argv)}' does not work: {text}")
        seconds = time.monotonic() - began
        for entry in list(self.out.iterdir()):
            target = self.kept / name / entry.name
            target.parent.mkdir(exist_ok=True)
            shutil.move(entry, target)
        return seconds

    def ended(self, name: str, how: str, after_s: float) -> list[str]:
        """What is wrong after a command was ended so; [] where nothing is."""
        shutil.rmtree(self.out)
        shutil.copytree(self.kept / name, self.out, symlinks=True)
        before = _digests(self.out)
        process, said = self._begun(name)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(after_s)
        family = _family(process.pid)
        done = process.poll() is not None
        if how == FULL:
            self.disk.fill()
            code = _waited(process, _WHOLE_S)
            self.disk.empty()
        elif how == FAILING:
            limit = (FAILS_AFTER_BYTES, resource.RLIM_INFINITY)
            for pid in family:
                with contextlib.suppress(OSError):
                    resource.prlimit(pid, resource.RLIMIT_FSIZE, limit)
            code = _waited(process, _WHOLE_S)
        else:
            with contextlib.suppress(OSError):
                process.send_signal(getattr(signal, how))
            code = _waited(process, _ENDS_S)
        wrong = _of_words(_text(said), code, (0, 1) if done else (0, 1, *CODES[how]))
        if code is None:
            wrong.append(f"still running {_ENDS_S:g} s after {how}")
        if orphans := _orphans(family):
            wrong.append(f"processes left: {orphans}")
        wrong += _of_results(self.out, before)
        if how == "SIGKILL":
            self._next()
        return wrong + self._left(family)

    def _begun(self, name: str) -> tuple[subprocess.Popen[bytes], Any]:
        said = tempfile.TemporaryFile()
        process = subprocess.Popen(
            module_command("palpate", *self.jobs[name].argv), stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=said, env=self._environment, start_new_session=True,
        )  # fmt: skip
        return process, said

    def _next(self) -> None:
        """The next command that writes to the same place, the folder of a page's pictures too: one that
        compiles nothing."""
        for folder in {self.out, *(left.parent for left in self.out.rglob(".palpate-*"))}:
            argv = ("export", str(self.model), "--to", "stl", "-o", str(folder / "next.stl"))
            subprocess.run(module_command("palpate", *argv), env=self._environment, capture_output=True)

    def _left(self, family: list[int]) -> list[str]:
        """Temporary files that are still there, in the order of their names."""
        shared = Path("/dev/shm")
        left = [str(p.relative_to(self.out.parent)) for p in self.out.rglob(".palpate-*")]
        left += [str(p.relative_to(self.out.parent)) for p in self.scratch.iterdir()]
        host = temporary_prefix().rsplit("-", 2)[0]
        if shared.is_dir():
            left += [p.name for pid in family for p in shared.glob(f"{host}-{pid}-*")]
        for path in self.scratch.iterdir():
            shutil.rmtree(path, ignore_errors=True) if path.is_dir() else path.unlink()
        return [f"left: {', '.join(sorted(left))}"] if left else []


def _waited(process: subprocess.Popen[bytes], longest_s: float) -> int | None:
    """Its exit code; None where it had to be killed. It does not outlive this process's own interrupt."""
    try:
        return process.wait(longest_s)
    except (subprocess.TimeoutExpired, KeyboardInterrupt) as why:
        with contextlib.suppress(OSError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        if isinstance(why, KeyboardInterrupt):
            raise
        return None


def _text(said: Any) -> str:
    said.seek(0)
    text = said.read().decode(errors="replace")
    said.close()
    return str(text)


def _of_words(text: str, code: int | None, codes: tuple[int, ...]) -> list[str]:
    lines = [x for x in text.replace("\r", "\n").splitlines() if x.strip()]
    lines = [x for x in lines if not any(mark in x for mark in _PROGRESS)]
    wrong = []
    if "Traceback" in text:
        wrong.append(f"traceback: ...{text.strip()[-600:]}")
    elif len(lines) > LINES:
        wrong.append(f"{len(lines)} lines: {' | '.join(lines)[-600:]}")
    if code is not None and code not in codes:
        wrong.append(f"exit code {code}: {' '.join(lines)[-300:]}")
    return wrong


def _family(pid: int) -> list[int]:
    """A process and all that it started, its group too."""
    found = {pid}
    with contextlib.suppress(psutil.Error):
        found |= {child.pid for child in psutil.Process(pid).children(recursive=True)}
    for other in psutil.pids():
        with contextlib.suppress(OSError):
            if os.getpgid(other) == pid:
                found.add(other)
    return sorted(found)


def _orphans(family: list[int]) -> list[str]:
    """Of these processes, what still runs after a while; it is ended."""
    end = time.monotonic() + _ORPHANS_S
    while (alive := [pid for pid in family if _command(pid)]) and time.monotonic() < end:
        time.sleep(0.1)
    words = [_command(pid) for pid in alive]
    for pid in alive:
        with contextlib.suppress(OSError):
            os.kill(pid, signal.SIGKILL)
    return [w for w in words if w]


def _command(pid: int) -> str:
    """The command line of a living process, '' where it is gone."""
    try:
        process = psutil.Process(pid)
        line = " ".join(process.cmdline())
        return "" if process.status() == psutil.STATUS_ZOMBIE else line[-120:]
    except psutil.Error:
        return ""


def _digests(folder: Path) -> dict[str, str]:
    return {
        str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest()
        for p in folder.rglob("*")
        if p.is_file()
    }


def _of_results(out: Path, before: dict[str, str]) -> list[str]:
    """Results that are neither those of before nor whole."""
    now = _digests(out)
    wrong = [f"gone: {name}" for name in before if name not in now and not _replaced(out / name, before)]
    for name, digest in now.items():
        if digest != before.get(name) and not Path(name).name.startswith(".palpate-"):
            if reason := _unwhole(out / name):
                wrong.append(f"half-written: {name} ({reason})")
    for marker in out.rglob("model.toml"):
        try:
            read_model(marker.parent)
        except PalpateError as error:
            wrong.append(f"no model any more: {error}")
    for description in out.rglob("*.toml"):
        if description.name != "model.toml" and b"[recording]" in description.read_bytes():
            try:
                read_recording(description)
            except PalpateError as error:
                wrong.append(f"no recording any more: {error}")
    return wrong


def _replaced(path: Path, before: dict[str, str]) -> bool:
    """Whether a file is missing because its MODEL folder is another one now, or is made anew by a batch."""
    return (path.parent / "model.toml").exists() or "batch" in path.parts


def _unwhole(path: Path) -> str:
    """Why a file is not whole; '' where it is, or nobody can say."""
    data = path.read_bytes()
    try:
        if path.suffix == ".json":
            json.loads(data)
        elif path.suffix == ".toml":
            tomllib.loads(data.decode())
        elif path.suffix == ".gz":
            data = gzip.decompress(data)
        if path.suffix in (".csv", ".gz") and data:
            rows = data.decode().splitlines()
            if not data.endswith(b"\n") or rows[-1].count(",") != rows[0].count(","):
                return "the last row is cut off"
        if path.suffix == ".html" and not data.rstrip().endswith(b"</html>"):
            return "no end"
        if path.suffix == ".png" and not data.endswith(b"IEND\xaeB`\x82"):
            return "no end"
    except (ValueError, EOFError, OSError) as error:
        return str(error)
    return ""
