"""Scripts that build the object and press it, one file each: for Newton and for Drake. They hold the file
that `palpate replay --renderer` runs, at the simulator's best settings, and print the tip's way in, m, and
the force on it, N."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from palpate.exporting.subject import Subject
from palpate.mechanics.extras import install_words
from palpate.render.options import BEST
from palpate.render.simulators.base import ScriptedAdapter
from palpate.render.simulators.drake import Drake
from palpate.render.simulators.newton import Newton

_PRESS = Template("""

START, PRESSED, NORMAL = np.array($start), np.array($pressed), np.array($normal)
STEPS = 400

scene = Scene(
$given
)
touch = Touch(scene, START)
last = START
for k in range(STEPS):
    at = START + (PRESSED - START) * min(1.0, 2 * (k + 1) / STEPS)
    touch.advance(at, (at - last) / scene.timestep_s)
    last = at
    if (k + 1) % 20 == 0:
        print(f"{float((START - at) @ NORMAL):.6f} {float(touch.force() @ NORMAL):.6f}")
""")


def write_newton(path: Path, subject: Subject) -> tuple[str, ...]:
    """Write the script for Newton; what it cannot say."""
    return (*_write(path, subject, Newton), *Newton.cannot[:1])


def write_drake(path: Path, subject: Subject) -> tuple[str, ...]:
    """Write the script for Drake; what it cannot say."""
    return _write(path, subject, Drake)


def _write(path: Path, subject: Subject, kind: type[ScriptedAdapter]) -> tuple[str, ...]:
    path.write_text(text_of(subject, kind), encoding="utf-8")
    return subject.run_notes(kind)


def text_of(subject: Subject, kind: type[ScriptedAdapter], numbers: str = "", settings: str = BEST) -> str:
    """The script, at its best settings or others."""
    run = subject.as_run(kind, numbers, settings)
    given = run.given(run.mesh_under(subject.near, subject.radius_m), subject.radius_m)
    press = _PRESS.substitute(
        start=subject.near.tolist(),
        pressed=subject.pressed.tolist(),
        normal=subject.normal.tolist(),
        given="\n".join(f"    {key}={_written(value)}," for key, value in given.items()),
    )
    package, _, name = kind.scene_module.rpartition(".")
    scene = files(package).joinpath(f"{name}.py").read_text(encoding="utf-8")
    head = f"# {subject.label}\n# {install_words(kind.extra)}; python FILE\n"
    return head + scene + press


def _written(value: Any) -> str:
    return f"np.array({value.tolist()})" if isinstance(value, np.ndarray) else repr(float(value))
