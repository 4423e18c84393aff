"""`python -m tests.support NAME [options]`, from the clone: run what checks at length, and print what it saw.

NAME: fuzz (hostile files, options and bytes; interrupts), soak (a long session of the servo),
effects_in_servo (each effect is felt), elements (locking), mesh_independence (of a press), modulus_mesh (of
the modulus), touch_model and large_presses (predicted forces where the truth is known), drag (what a dragged
press feels).
"""

from __future__ import annotations

import importlib
import sys

from tools.script import script

NAMES = (
    "drag",
    "effects_in_servo",
    "elements",
    "fuzz",
    "large_presses",
    "mesh_independence",
    "modulus_mesh",
    "soak",
    "touch_model",
)


def main(words: list[str]) -> int:
    """Run one; 2 and a line on standard error for bad arguments."""
    if not words or words[0] not in NAMES:
        print(f"tests.support: name one of {', '.join(NAMES)}", file=sys.stderr)
        return 2
    return script(importlib.import_module(f"tests.support.{words[0]}"), words[1:])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
