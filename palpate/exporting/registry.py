"""Which programs a model can be written for."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from mechanics.errors import OptionError
from mechanics.files import atomic_file
from mechanics.model import Model
from mechanics.surface_files import UNITS
from palpate.exporting import abaqus, gmsh, mujoco, sofa, stl
from palpate.exporting.subject import Subject, subject_of

Writer = Callable[[Path, Subject], tuple[str, ...]]
FORMATS: dict[str, tuple[str, Writer]] = {
    "mujoco": (".xml", mujoco.write),
    "sofa": (".scn", sofa.write),
    "abaqus": (".inp", abaqus.write),
    "gmsh": (".msh", gmsh.write),
    "stl": (".stl", stl.write),
}
"""Name -> the file's suffix and its writer, which returns what the format cannot say."""


def write(
    model: Model,
    to: str,
    path: Path | str,
    *,
    at: np.ndarray | None = None,
    depth_m: float | None = None,
    unit: str = "m",
) -> tuple[str, ...]:
    """Write a model for another program; what its format cannot say, one line each.

    at, depth_m: of the press in the scene (see `subject_of`). unit: of an STL's lengths. Raises OptionError for
    a program or suffix that does not fit.
    """
    if to not in FORMATS:
        raise OptionError(f"--to is '{to}'; allowed are {', '.join(FORMATS)}")
    suffix, writer = FORMATS[to]
    path = Path(path)
    if path.suffix.lower() != suffix:
        raise OptionError(f"'{path}' must end in {suffix} for {to}")
    if unit not in UNITS or (unit != "m" and to != "stl"):
        allowed = ", ".join(UNITS) if to == "stl" else "m: the other formats are in metres"
        raise OptionError(f"--unit is '{unit}'; allowed are {allowed}")
    if depth_m is not None and not depth_m > 0:
        raise OptionError(f"--depth is {depth_m} m; it must be greater than 0")
    subject = subject_of(model, at, depth_m)
    chosen = partial(stl.write, unit=unit) if to == "stl" else writer
    with atomic_file(path) as temporary:
        notes = chosen(temporary, subject)
    lost = [f"not in the file: {', '.join(subject.left_out)}"] if subject.left_out else []
    return (*notes, *lost)
