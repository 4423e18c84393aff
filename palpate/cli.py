"""The `palpate` command: finds the sub-command's module, parses, runs, and turns errors into one line.

Exit codes: 0 success, 1 a check that the user asked for failed, 2 bad arguments or input, 130 interrupted.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Sequence

from mechanics.errors import PalpateError
from palpate import __version__

COMMANDS = {
    "demo": "the main job on the embedded example; prints the report's path",
    "reconstruct": "a recording becomes a model",
    "model": "a MODEL from a surface's file and a modulus",
    "import": "other programs' files become a recording",
    "export": "a MODEL for MuJoCo, SOFA, Abaqus, Gmsh, or as STL",
    "replay": "a recorded tip path through a renderer, headless",
    "press": "one scripted press on a model, headless",
    "compare": "FEM against interpolated 1D models on held-out palpations",
    "diagnose": "the sim-to-real gap: where, which effect, how far it shrinks",
    "touch": "feel a model or scene at 1 kHz",
    "devices": "which devices are there, and for the others why not",
    "simulate": "the virtual laboratory: a person's exploration of a phantom",
    "bench": "benchmarks: medians, spreads and ratios",
    "batch": "many recordings at once",
}
"""Every sub-command, one line each; its module is `palpate.commands.NAME`."""
MODULES = {"import": "palpate.commands.import_"}
"""Where a command's name is a word of Python's own."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    argv = list(sys.argv[1:] if argv is None else argv)
    parser = _top_parser()
    if not argv or argv[0].startswith("-"):
        parser.parse_args(argv)
        parser.print_help()
        return 2 if not argv else 0
    name = argv[0]
    if name not in COMMANDS:
        parser.error(f"'{name}' is no command; allowed are {', '.join(COMMANDS)}")
    try:
        module = importlib.import_module(MODULES.get(name, f"palpate.commands.{name}"))
    except ModuleNotFoundError as error:
        if error.name != f"palpate.commands.{name}":
            raise
        print(f"palpate {name}: not in this version yet; see CHANGELOG.md for what is", file=sys.stderr)
        return 2
    command = argparse.ArgumentParser(
        prog=f"palpate {name}",
        description=module.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    module.add_arguments(command)
    arguments = command.parse_args(argv[1:])
    try:
        return int(module.run(arguments) or 0)
    except PalpateError as error:
        print(f"palpate {name}: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"palpate {name}: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


def _top_parser() -> argparse.ArgumentParser:
    width = max(map(len, COMMANDS))
    listing = "\n".join(f"  {name:<{width}}  {summary}" for name, summary in COMMANDS.items())
    parser = argparse.ArgumentParser(
        prog="palpate",
        usage="palpate COMMAND ... | palpate COMMAND --help",
        description="Touch a real thing for two minutes, and feel its copy.",
        epilog=f"commands:\n{listing}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"palpate {__version__}")
    return parser


if __name__ == "__main__":
    sys.exit(main())
