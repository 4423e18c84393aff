"""Contacts, base and support read off a 110 s recording, against the paper's 10 s."""

from __future__ import annotations

import argparse
from typing import Any

from benchmarks.timing import measure, table
from mechanics.recording import read_recording
from reconstruct.contacts import explore
from scenes.embedded import embedded_recording

SUMMARY = "contacts, base and support of a 110 s recording"
PAPER_S = 10.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC and repeats."""
    parser.add_argument("recording", nargs="?", help="recording (default: the embedded one)")
    parser.add_argument("--repeats", type=int, default=5)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Time both modes on samples already in memory, and reading the file apart."""
    path = arguments.recording or embedded_recording()
    recording = read_recording(path)
    reading = measure(lambda: read_recording(path), repeats=2, warm_up=0)
    rows, result = [], {"read_s": reading.median_s}
    for method in ("noise", "paper"):
        timing = measure(lambda method=method: explore(recording, method=method), repeats=arguments.repeats)
        rows.append([method, timing.median_s, timing.spread, timing.cpu_median_s, PAPER_S / timing.median_s])
        result[method] = {"median_s": timing.median_s, "spread": timing.spread, "cpu_s": timing.cpu_median_s}
    print(f"{recording.name}: {recording.t[-1] - recording.t[0]:.0f} s, {len(recording.t)} samples")
    print(table(["mode", "median [s]", "spread", "CPU [s]", "paper's 10 s over it"], rows))
    print(f"reading the file: {reading.median_s:.2f} s")
    return result
