"""`python -m palpate`, and what the command `palpate` runs."""

import os
import signal
import sys


def main() -> int:
    """The command line of this process."""
    # until it listens itself, Ctrl-C ends it without a word
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    # what is read once, as NumPy is loaded: see palpate.mechanics.one_thread
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from palpate.cli import main as command_line

    return command_line()


if __name__ == "__main__":
    sys.exit(main())
