"""`python -m palpate`: the same as the command `palpate`."""

import sys

from palpate.cli import main

if __name__ == "__main__":
    sys.exit(main())
