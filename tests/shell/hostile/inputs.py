"""A sound recording and a sound model, of which the tests spoil one thing, and how a refusal has to look."""

from __future__ import annotations

import io
import re
import signal
from contextlib import contextmanager, redirect_stderr
from pathlib import Path

import numpy as np

from palpate import cli
from palpate.mechanics.model.material import Ball, ObjectMaterial, Skin
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.shape.tetmesh import box_mesh

HEADER = "t,x,y,z,fx,fy,fz"
DESCRIPTION = """[recording]
sample_rate_hz = 1000.0
force_on = "tool"
boundary_phase = [0.0, 0.1]
[tool]
tip_radius_m = 0.005
[sensor]
force_noise_std_n = 0.01
[object]
poisson_ratio = 0.49
"""


def rows(count=400, *, step=1e-3, scale=1.0):
    """Samples of a tip that goes to and fro over 80 mm."""
    t = step * np.arange(count)
    x = scale * 0.04 * np.sin(np.arange(count) / 30)
    return np.column_stack([t, x, 0 * t, 0 * t + 0.05 * scale, 0 * t, 0 * t, 0 * t])


def text_of(table, header=HEADER):
    return header + "\n" + "\n".join(",".join(f"{v:.9g}" for v in row) for row in table) + "\n"


def changed(table, row, column, value):
    table = table.copy()
    table[row, column] = value
    return table


def one_line(error, *files):
    text = str(error.value)
    assert "\n" not in text and len(text) < 700
    assert all(str(file) in text for file in files)


def described(old, new):
    assert old in DESCRIPTION
    return DESCRIPTION.replace(old, new)


def block():
    mesh = box_mesh((2, 2, 1), (0.06, 0.06, 0.03))
    return Model(
        mesh,
        ObjectMaterial(
            20e3,
            0.45,
            (19e3, 21e3),
            "neo-hookean",
            {"lump": Ball((0, 0, 0.015), 0.01, 6.0)},
            skin=Skin(0.003, 3.0),
        ),
        Support(np.zeros(3), np.array([0.0, 0.0, 1.0])),
        Tool(0.005),
        0.02,
        effects={
            "friction_slip": {"mu": 0.3},
            "strain_stiffening": {"c20_over_c10": 0.35},
            "compliant_base": {"k_normal_pa_per_m": 1e7, "k_tangential_pa_per_m": 1e7},
            "unbonded_base": {"bonded_fraction": 0.5, "direction": [1.0, 0.0, 0.0]},
            "viscoelasticity": {"g": [0.3], "tau_s": [0.3]},
        },
    )


def command(*words):
    """(exit code, what it says on stderr) of the command line."""
    said = io.StringIO()
    with redirect_stderr(said):
        try:
            code = cli.main([str(w) for w in words])
        except SystemExit as stop:
            code = int(stop.code)
    return code, said.getvalue()


def refused(words, *line):
    code, said = command(*line)
    assert code == 2 and re.search(words, said) and "Traceback" not in said, said
    assert len(said.strip().splitlines()) == 1, said


def contents(folder):
    return {p: p.read_bytes() for p in Path(folder).rglob("*") if p.is_file()}


@contextmanager
def full_disk(most=100):
    """Files cannot grow beyond `most` bytes, which the system says as it says that a disk is full."""
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, before)
