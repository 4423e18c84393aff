"""The `palpate` command: finds the operation, parses, runs, and turns errors into one line.

Exit codes: 0 success, 1 a check that the user asked for failed, 2 bad arguments or input, 130 interrupted,
143 ended by SIGTERM.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from palpate.child import listen
from palpate.operations._list import commands

if TYPE_CHECKING:
    import argparse


class Ended(KeyboardInterrupt):
    """Another process asked this one to end; everything is tidied up as after Ctrl-C."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    before = listen(_leave)
    prog = "palpate"
    try:
        # nothing is open yet, and libraries that are half loaded do not bear an exception: leave at once
        words = list(sys.argv[1:] if argv is None else argv)
        if "_ARGCOMPLETE" in os.environ:
            from palpate.operations.completion import complete

            complete(os.environ.get("COMP_LINE", ""))
        command, name, code = _loaded(words)
        if name is None:
            return code
        prog = command.prog
        listen(_interrupt)
        return _run(command, name, words[1:])
    except ModuleNotFoundError as error:
        if _is_ours(error.name):
            raise
        print(
            f"{prog}: the library '{error.name}' is not installed for {sys.executable}: run the Python that "
            "Palpate was installed into, or install it into this one ('pip install .' in its folder)",
            file=sys.stderr,
        )
        return 2
    except KeyboardInterrupt as how:
        print(f"{prog}: interrupted", file=sys.stderr)
        code = 143 if isinstance(how, Ended) else 130
        if argv is None:
            _end(code)
        return code
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _loaded(argv: list[str]) -> tuple[argparse.ArgumentParser, str | None, int]:
    """(parser, the command's name or None, then the exit code)."""
    parser = _top_parser()
    if not argv or argv[0].startswith("-"):
        parser.parse_args(argv)
        parser.print_help()
        return parser, None, 2 if not argv else 0
    name = argv[0]
    if name not in commands():
        from palpate.mechanics.names import unknown

        parser.exit(2, f"palpate: {unknown(name, 'command', commands())}\n")
    from palpate.operations._run import parser_of

    return parser_of(name), name, 0


def _is_ours(name: str | None) -> bool:
    """Whether a module that is missing is a part of this program: that is a bug, not an installation."""
    return name is None or name.partition(".")[0] == "palpate"


def _run(command: argparse.ArgumentParser, name: str, words: list[str]) -> int:
    """The one place where errors become a line and an exit code."""
    from palpate.logs import on_stderr
    from palpate.mechanics.disk.reading import refusal
    from palpate.mechanics.errors import PalpateError
    from palpate.operations._run import run_command

    def refused(words: str) -> int:
        print(f"{command.prog}: {' '.join(words.split())}", file=sys.stderr)
        return 2

    with on_stderr(command.prog):
        try:
            return run_command(name, words, command)
        except PalpateError as error:
            return refused(str(error))
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return 0
        except OSError as error:
            return refused(refusal(error, None, "used"))
        except MemoryError as error:
            return refused(
                f"not enough memory ({error}): use a coarser mesh or a shorter recording, or close programs"
            )


def _leave(number: int, frame: Any) -> None:
    os.write(2, b"palpate: interrupted\n")
    os._exit(128 + number)


def _interrupt(number: int, frame: Any) -> None:
    listen(_leave)  # a second time leaves without tidying up
    raise KeyboardInterrupt if number == signal.SIGINT else Ended


def _end(code: int) -> None:
    """End this process without unloading libraries, some of which were interrupted at their work."""
    import atexit

    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def _top_parser() -> argparse.ArgumentParser:
    import argparse

    width = max(map(len, commands()))
    listing = "\n".join(f"  {name:<{width}}  {summary}" for name, summary in commands().items())
    parser = argparse.ArgumentParser(
        prog="palpate",
        usage="palpate COMMAND ... | palpate COMMAND --help",
        description="Touch a real thing for two minutes, and feel its copy.",
        epilog=f"commands:\n{listing}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    from palpate.version import __version__

    parser.add_argument("--version", action="version", version=f"palpate {__version__}")
    return parser


if __name__ == "__main__":
    sys.exit(main())
