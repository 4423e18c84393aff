"""How well one modulus and one shape parameter tell how silicones are compressed: tests that no fit has seen.

The set: 19 mixtures of Ecoflex and thinner, two specimens of five tests each (Dawood et al. 2026, CC BY 4.0).
Each test is predicted from the others of its mixture, and from those of the other specimen alone; the error
is the median over samples between 2 % strain and the greatest, in shares of the stress.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.errors import RecordingError
from palpate.benchmarks.timing import table
from reconstruct.external.compression import Compression, fit_elastomer, read_compression

SUMMARY = "compression of silicones: one modulus and one shape parameter on unseen tests"
FROM_STRAIN = 0.02


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Folder, greatest strain."""
    parser.add_argument("--data", required=True, help="folder with a folder of CSVs for every mixture")
    parser.add_argument("--strain", type=float, default=0.4, help="greatest strain (default: 0.4)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Print a row a mixture and the medians."""
    folders = sorted(p for p in Path(arguments.data).iterdir() if any(p.glob("*.csv")) and p.is_dir())
    if not folders:
        raise RecordingError(f"--data {arguments.data} holds no folder with CSVs of compression tests")
    rows, figures = [], {}
    for folder in folders:
        paths = sorted(folder.glob("*.csv"))
        tests = [read_compression(path) for path in paths]
        specimen = [path.stem.rsplit("_", 1)[-1][0] for path in paths]
        whole = fit_elastomer(tests, to_strain=arguments.strain)
        count = range(len(tests))
        unseen = [[o for o in count if o != k] for k in count]
        tested = _errors(tests, unseen, arguments)
        across = [[o for o in count if specimen[o] != specimen[k]] for k in count]
        other = _errors(tests, across, arguments)
        plain = _errors(tests, unseen, arguments, ratio=0.0)
        figures[folder.name] = {
            "young_modulus_pa": whole.young_modulus_pa, "c20_over_c10": whole.c20_over_c10,
            "unseen_test": tested, "unseen_specimen": other, "neo_hookean": plain,
        }  # fmt: skip
        rows.append(
            [folder.name, f"{whole.young_modulus_pa / 1e3:.1f}", f"{whole.c20_over_c10:+.3f}",
             f"{plain:.1%}", f"{tested:.1%}", f"{other:.1%}"]
        )  # fmt: skip
    print(
        table(
            ["mixture", "E, kPa", "c20/c10", "neo-Hookean", "unseen test", "unseen specimen"],
            rows,
        )
    )
    names = ("neo_hookean", "unseen_test", "unseen_specimen")
    medians = {name: float(np.median([f[name] for f in figures.values()])) for name in names}
    worst = {name: float(max(f[name] for f in figures.values())) for name in names}
    softer = sum(f["c20_over_c10"] < 0 for f in figures.values())
    said = [f"{name.replace('_', ' ')} {medians[name]:.1%} (worst {worst[name]:.1%})" for name in names]
    print(f"{softer} of {len(figures)} soften; {', '.join(said)}")
    return {"mixtures": figures, "median": medians, "worst": worst, "soften": softer}


def _errors(
    tests: list[Compression],
    seen: list[list[int]],
    arguments: argparse.Namespace,
    ratio: float | None = None,
) -> float:
    """The median over tests of each one's median error, predicted from those seen; ratio: c20 / c10 held."""
    errors = []
    for test, others in zip(tests, seen, strict=True):
        material = fit_elastomer([tests[k] for k in others], to_strain=arguments.strain, ratio=ratio)
        use = (test.strain >= FROM_STRAIN) & (test.strain <= arguments.strain)
        errors.append(float(np.median(np.abs(material.stress(test.strain[use]) / test.stress[use] - 1))))
    return float(np.median(errors))
