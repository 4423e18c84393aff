"""The check-up: faults put into sound recordings and found, named rightly; warnings on sound ones.

Sound recordings: the embedded one, those of --recordings DIR, and --variety N explorations as varied as the
world with touches in closed form (Hertz and Mindlin: minutes where the laboratory needs hours). A warning is
false where reconstruction could use the recording: one that it refuses anyway is counted by itself. A fault
is found where the check-up finds anything, named rightly where the first finding is one of its names.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.timing import table
from palpate.mechanics.errors import ContactError, PalpateError
from palpate.mechanics.recording.recording import Recording, read_recording
from palpate.reconstruction.checks.finding import Finding
from palpate.reconstruction.checks.registry import REFUSALS, check
from palpate.reconstruction.steps.s3_contacts.contacts import explore
from palpate.scenes.embedded import embedded_recording

from .faults import FAULTS
from .quick_touches import varied


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """--recordings, --variety, --start, --each, --fault, --seed."""
    parser.add_argument(
        "--recordings", metavar="DIR", action="append", default=[], help="of sound recordings"
    )
    parser.add_argument("--variety", type=int, default=20, help="varied explorations (default: 20)")
    parser.add_argument("--start", type=int, default=0, help="the first one's number (default: 0)")
    parser.add_argument(
        "--each", type=int, default=10, help="recordings, drawn at random, that get each fault (default: 10)"
    )
    parser.add_argument("--fault", action="append", choices=list(FAULTS), help="only this one (repeatable)")
    parser.add_argument("--seed", type=int, default=0, help="of what is drawn at random (default: 0)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Check the sound recordings, then each fault in some of them; print both tables."""
    recordings, findings = [], {}
    with tempfile.TemporaryDirectory() as folder:
        for recording in _sound(arguments, Path(folder)):
            recordings.append(recording)
            findings[recording.name] = check(recording)
            words = "; ".join(f.line() for f in findings[recording.name]) or "nothing"
            print(f"{recording.name}: {words}", file=sys.stderr, flush=True)
    warned = {name: [f for f in found if f.name not in REFUSALS] for name, found in findings.items()}
    refused = [r.name for r in recordings if findings[r.name] and _refused(r, findings[r.name])]
    warned |= {name: [] for name in refused}
    usable = [r for r in recordings if r.name not in refused and not warned[r.name]]
    false = {name: found for name, found in warned.items() if found}
    print(
        f"{len(recordings)} sound recordings: {len(false)} with a warning "
        f"({100 * len(false) / max(len(recordings), 1):.1f} %); {len(refused)} that reconstruction refuses"
    )
    for name, found in false.items():
        print(f"- {name}: " + "; ".join(f.line() for f in found))
    random = np.random.default_rng(arguments.seed)
    rows, result = [], {}
    for fault in arguments.fault or FAULTS:
        chosen = [usable[i] for i in random.permutation(len(usable))[: arguments.each]]
        result[fault] = _tried(fault, chosen, random)
        print(f"{fault}: {result[fault]}", file=sys.stderr, flush=True)
        rows.append([fault, *(result[fault][k] for k in ("of", "found", "named", "grave")),
                     ", ".join(f"{n} ({k})" for n, k in result[fault]["otherwise"].items())])  # fmt: skip
    print(table(["fault", "of", "found", "named rightly", "grave", "first named otherwise"], rows))
    return {
        "recordings": len(recordings),
        "warned": {name: [f.line() for f in found] for name, found in false.items()},
        "refused": refused,
        "faults": result,
    }


def _refused(recording: Recording, found: tuple[Finding, ...]) -> bool:
    """Whether reconstruction itself stops at a recording with findings: then no warning was false."""
    if any(f.name in REFUSALS for f in found):
        return True
    try:
        explore(recording)
    except ContactError:
        return True
    return False


def _sound(arguments: argparse.Namespace, folder: Path) -> Iterator[Recording]:
    yield read_recording(embedded_recording())
    for directory in arguments.recordings:
        for description in sorted(Path(directory).glob("*.toml")):
            yield read_recording(description)
    for seed in range(arguments.start, arguments.start + arguments.variety):
        yield varied(seed, folder)


def _tried(fault: str, recordings: list[Recording], random: np.random.Generator) -> dict[str, Any]:
    """How often a fault was found, named rightly, and grave; what else came first."""
    it = FAULTS[fault]
    found = named = grave = count = 0
    otherwise: Counter[str] = Counter()
    for recording in recordings:
        count += 1
        try:
            findings = check(it.change(recording, random))
        except PalpateError:  # a recording that is refused where it is read
            found, named, grave = found + 1, named + 1, grave + 1
            continue
        found += bool(findings)
        grave += any(f.grave for f in findings)
        if findings and findings[0].name in it.names:
            named += 1
        else:
            otherwise[findings[0].name if findings else "nothing"] += 1
    return {"of": count, "found": found, "named": named, "grave": grave, "otherwise": dict(otherwise)}
