"""The one list of operations: name, module, Python calls, and the summary that `palpate --help` shows.

It imports nothing, so that help is quick. To add an operation, write `shell/operations/NAME.py` and a line
here.
"""

from __future__ import annotations

from typing import NamedTuple


class Entry(NamedTuple):
    """One operation. calls: its names in `import palpate as pp`, the command's own first; module: where it
    is, by default `palpate.operations.NAME`; command: whether the command line has it."""

    summary: str
    calls: str = ""
    module: str = ""
    command: bool = True


OPERATIONS = {
    "demo": Entry("the main job on the embedded example; prints the report's path"),
    "check": Entry("what may be wrong with a recording, before it is believed", "check"),
    "reconstruct": Entry("a recording becomes a model", "reconstruct"),
    "model": Entry("a MODEL from a surface's file and a modulus", "model_of"),
    "open": Entry(
        "whatever it is: understood, checked, reconstructed or measured", "open", "palpate.operations.open_"
    ),
    "import": Entry(
        "other programs' files become a recording", "import_table read_table", "palpate.operations.import_"
    ),
    "export": Entry("a MODEL as a page to be pressed, for MuJoCo, SOFA, Abaqus, Gmsh, or STL", "export"),
    "material": Entry("the material of a specimen from a machine's curves", "material"),
    "replay": Entry("a recorded tip path through a renderer, headless", "replay"),
    "press": Entry("one scripted press on a model, headless", "press"),
    "compare": Entry("finite elements against spring-damper models; or before and after", "compare changes"),
    "diagnose": Entry("what is wrong with a simulation: where, which effect, how far it shrinks", "diagnose"),
    "calibrate": Entry("the instrument told from presses on something known", "calibrate"),
    "touch": Entry("feel a model or scene at 1 kHz"),
    "devices": Entry("which devices are there, and for the others why not"),
    "explore": Entry("where to touch next and why, and when to stop"),
    "simulate": Entry("the virtual laboratory: a person's exploration of a phantom", "simulate"),
    "bench": Entry("benchmarks: medians, spreads and ratios"),
    "batch": Entry("many recordings at once", "batch"),
    "completion": Entry("what lets a shell complete all this: bash, zsh or fish"),
    "load": Entry("the model of a folder or scene", "load", command=False),
    "read_recording": Entry("a recording's file or arrays", "read_recording recording", command=False),
    "renderer": Entry("what answers a tip at 1 kHz", "renderer", command=False),
}


def commands() -> dict[str, str]:
    """Command to summary, in the order of help."""
    return {name: entry.summary for name, entry in OPERATIONS.items() if entry.command}


def module_of(name: str) -> str:
    """The module of an operation, by its name in the list."""
    return OPERATIONS[name].module or f"palpate.operations.{name}"


def calls() -> dict[str, str]:
    """Python name to module, of every operation that `import palpate as pp` has."""
    return {call: module_of(name) for name, entry in OPERATIONS.items() for call in entry.calls.split()}
