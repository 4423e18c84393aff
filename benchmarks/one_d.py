"""1D models of every press of a recording, against the paper's 0.5 s."""

from __future__ import annotations

import argparse
from typing import Any

from benchmarks._recording import add_recording, recording_of, timed
from palpate.reconstruction.steps.s3_contacts.contacts import explore
from palpate.reconstruction.steps.s6_one_d import fit_paper, fit_robust, profiles

PAPER_S = 0.5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC and repeats."""
    add_recording(parser, repeats=9)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Time the profiles and both estimators."""
    exploration = explore(recording_of(arguments))
    presses = profiles(exploration.presses)
    print(f"{len(presses)} presses")
    work = {
        "profiles": lambda: profiles(exploration.presses),
        "paper's estimators": lambda: fit_paper(presses),
        "bounded, robust": lambda: fit_robust(presses),
    }
    return {"presses": len(presses), **timed(work, arguments.repeats, PAPER_S)}
