"""Contacts, base and support read off a 110 s recording, against the paper's 10 s."""

from __future__ import annotations

import argparse
from typing import Any

from benchmarks._recording import add_recording, recording_of, timed
from palpate.reconstruction.steps.s3_contacts.contacts import explore

PAPER_S = 10.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC and repeats."""
    add_recording(parser, repeats=5)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Time both modes on samples already in memory, and reading the file apart."""
    recording = recording_of(arguments)
    print(f"{recording.name}: {recording.t[-1] - recording.t[0]:.0f} s, {len(recording.t)} samples")
    work = {
        "reading the file": lambda: recording_of(arguments),
        "noise (default)": lambda: explore(recording, method="noise"),
        "paper": lambda: explore(recording, method="paper"),
    }
    return timed(work, arguments.repeats, PAPER_S)
