"""Benchmarks: medians, spreads, and ratios against a peer or limit in the same run.

They are in the folder `benchmarks` of a clone of the project: run the command inside the clone.
"""

from __future__ import annotations

import importlib
import os
import pkgutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from palpate.mechanics.errors import OptionError
from palpate.mechanics.names import unknown
from palpate.operations._call import Call
from palpate.operations._declare import argument, operation
from palpate.operations._to_argparse import OneLineParser
from palpate.output import emit_json
from palpate.schemas import labelled

_HELPERS = ("evidence", "timing")


def clone() -> Path:
    """The clone of the project that the working folder lies in. Raises OptionError outside of one."""
    here = Path.cwd()
    for folder in (here, *here.parents):
        if (folder / "benchmarks" / "__init__.py").is_file() and (folder / "shell" / "cli.py").is_file():
            return folder
    raise OptionError(
        f"benchmarks come with a clone of the project, not with the installed package: '{here}' lies in no "
        "clone; change into the clone and run it there"
    )


def names() -> list[str]:
    """The benchmarks of the clone that one stands in, as the command line spells them."""
    found = (m.name for m in pkgutil.iter_modules([str(clone() / "benchmarks")]) if not m.ispkg)
    return sorted(n.replace("_", "-") for n in found if n not in _HELPERS and not n.startswith("_"))


def _keep(path: str, name: str, options: Sequence[str], figures: Any) -> None:
    """Write the figures, and what they took, with command, commit, date and processor."""
    evidence = importlib.import_module("benchmarks.evidence")  # it lies in the clone, not in the product
    if not figures:
        raise OptionError(f"--evidence: 'palpate bench {name}' gives no figures to keep")
    words = ["palpate", "bench", name, *_deciding(options)]
    kept = evidence.write(path, evidence.measured(" ".join(words), [*figures, *evidence.spent()], clone()))
    print(f"kept: {kept}", file=sys.stderr)


_PLACES = ("--evidence", "--json", "--work", "--data", "--python", "--page")


def _deciding(words: Sequence[str]) -> list[str]:
    """The options that decide what was measured, without those that say where on a machine things lie."""
    kept: list[str] = []
    left_out = False
    for word in words:
        if word.startswith("-") and word != "-":
            left_out = word in _PLACES
            if left_out or word.startswith(tuple(f"{name}=" for name in _PLACES)):
                continue
        elif left_out:
            left_out = False
            continue
        kept.append(word)
    return kept


@operation(progress=False)
def bench(
    name: Annotated[str, argument("which; without a known name the error lists them", metavar="name")],
    rest: Annotated[
        Sequence[str], argument("the benchmark's own options (NAME --help)", metavar="...", count="...")
    ] = (),
    *,
    call: Call,
) -> None:
    """Run one benchmark, and write its figures. Raises OptionError for one that is not there."""
    if name not in names():
        raise OptionError(unknown(name, "benchmark", names()))
    sys.path.insert(0, str(clone()))
    inherited = os.environ.get("PYTHONPATH")  # processes of its own find the benchmarks too
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(clone()), inherited]))
    module = importlib.import_module(f"benchmarks.{name.replace('-', '_')}")
    parser = OneLineParser(prog=f"palpate bench {name}", description=module.__doc__)
    module.add_arguments(parser)
    parser.add_argument(
        "--json", metavar="PATH", default=call.out.destination, help="write the figures as JSON"
    )
    parser.add_argument(
        "--evidence",
        metavar="PATH",
        nargs="?",
        const=str(clone() / "docs" / "evidence" / f"{name}.json"),
        help="keep figures, command, commit, date and processor (default: docs/evidence/NAME.json)",
    )
    own = parser.parse_args(rest)
    figures = module.run(own)
    emit_json(labelled("bench", figures), own.json)
    if own.evidence:
        _keep(own.evidence, name, rest, figures.get("figures", ()))
