"""`python -m tests.support NAME [options]`, from the clone: run what checks at length, and print what it saw.

NAME: fuzz (hostile files, options and bytes; interrupts), check_up (faults found in recordings), soak (a long
session of the servo), elements (locking), touch_model and large_presses (predicted forces where the truth is
known), drag (what a dragged press feels).
"""

from __future__ import annotations

import importlib
import sys

from mechanics.errors import PalpateError
from palpate.arguments import OneLineParser, emit_json

NAMES = ("check_up", "drag", "elements", "fuzz", "large_presses", "soak", "touch_model")


def main(words: list[str]) -> int:
    """Run one; 2 and a line on standard error for bad arguments."""
    try:
        if not words or words[0] not in NAMES:
            raise PalpateError(f"name one of {', '.join(NAMES)}")
        module = importlib.import_module(f"tests.support.{words[0]}")
        parser = OneLineParser(prog=f"python -m tests.support {words[0]}", description=module.__doc__)
        module.add_arguments(parser)
        parser.add_argument("--json", metavar="PATH", help="write the figures as JSON")
        arguments = parser.parse_args(words[1:])
        emit_json(module.run(arguments), arguments.json)
    except PalpateError as error:
        print(f"tests.support: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
