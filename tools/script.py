"""A module with `add_arguments` and `run`, as `palpate bench` runs them, started by `python -m`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from types import ModuleType

from palpate.mechanics.errors import PalpateError
from palpate.operations._to_argparse import OneLineParser
from palpate.output import emit_json


def script(module: ModuleType, words: Sequence[str] | None = None) -> int:
    """Run it with the words of the command line; its exit code, 2 with a line on standard error for bad
    arguments or input."""
    spec = module.__spec__
    name = spec.name if spec is not None else module.__name__
    parser = OneLineParser(prog=f"python -m {name}", description=module.__doc__)
    module.add_arguments(parser)
    parser.add_argument("--json", metavar="PATH", help="write the figures as JSON")
    try:
        arguments = parser.parse_args(words)
        emit_json(module.run(arguments), arguments.json)
    except PalpateError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 2
    return 0
