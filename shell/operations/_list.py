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
    "demo": Entry("run the main steps on the embedded example; prints the report's path"),
    "check": Entry("check a recording before a model is made of it", "check"),
    "reconstruct": Entry("make a finite element model from a recording", "reconstruct"),
    "model": Entry("make a model from a surface file and a Young's modulus", "model_of"),
    "open": Entry(
        "recognise a file, check it, and make a model or material of it", "open", "palpate.operations.open_"
    ),
    "import": Entry(
        "convert other programs' files to a recording",
        "import_table read_table",
        "palpate.operations.import_",
    ),
    "export": Entry("write a model as a page, or for MuJoCo, SOFA, Abaqus, Gmsh and others", "export"),
    "material": Entry("fit a material to the force curves of a testing machine", "material"),
    "replay": Entry("run a recorded tip path through a renderer, headless", "replay"),
    "press": Entry("run one scripted press on a model, headless", "press"),
    "compare": Entry("compare FEM with spring-damper models, or two recordings", "compare changes"),
    "diagnose": Entry("find which effect a simulation leaves out, where, and how large it is", "diagnose"),
    "tune": Entry("tune another simulator to the measured force, its physics held", "tune"),
    "calibrate": Entry("calibrate the instrument by presses on a known object", "calibrate"),
    "touch": Entry("feel a model or scene at 1 kHz", "touch"),
    "devices": Entry("list the devices, and why some are not available"),
    "explore": Entry("suggest where to touch next, why, and when to stop"),
    "simulate": Entry("simulate a person's exploration of a phantom (the virtual laboratory)", "simulate"),
    "conformance": Entry("write the kit that checks a soft-contact simulator", "conformance"),
    "bench": Entry("run a benchmark: medians, spreads and ratios"),
    "batch": Entry("reconstruct, compare and diagnose many recordings", "batch"),
    "completion": Entry("print a completion script for bash, zsh or fish"),
    "load": Entry("the model of a folder or scene", "load", command=False),
    "read_recording": Entry("a recording's file or arrays", "read_recording recording", command=False),
    "renderer": Entry("a renderer: the force on a tip at 1 kHz", "renderer", command=False),
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
