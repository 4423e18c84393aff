"""Abaqus: an input deck with nodes, hybrid tetrahedra, material by ranges of modulus, base held, and a
rigid sphere that is pressed in."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from palpate.exporting.subject import Subject

_RANGES = 32


def write(path: Path, subject: Subject) -> tuple[str, ...]:
    """Write the deck; what it cannot say."""
    mesh = subject.mesh
    moduli, group = _grouped(subject.element_modulus_pa)
    tip = len(mesh.points) + 1
    kind = "C3D10H" if mesh.order == 2 else "C3D4H"
    lines = ["*Heading", f" {subject.label}", "*Node"]
    lines += [f"{i}, {x:.9g}, {y:.9g}, {z:.9g}" for i, (x, y, z) in enumerate(mesh.points, 1)]
    lines += [f"{tip}, " + ", ".join(f"{v:.9g}" for v in subject.start)]
    for g in range(len(moduli)):
        lines.append(f"*Element, type={kind}, elset=PART{g + 1}")
        rows = np.flatnonzero(group == g)
        lines += [f"{i + 1}, " + ", ".join(map(str, mesh.tetrahedra[i] + 1)) for i in rows]
    for g, modulus in enumerate(moduli):
        lines += [f"*Solid Section, elset=PART{g + 1}, material=SOFT{g + 1}", ","]
        lines += [f"*Material, name=SOFT{g + 1}", *_law(subject, float(modulus))]
    lines += ["*Nset, nset=BASE", *_wrapped(np.flatnonzero(mesh.fixed) + 1)]
    lines += ["*Nset, nset=TOUCHABLE", *_wrapped(np.flatnonzero(mesh.touchable) + 1)]
    lines += ["*Surface, type=NODE, name=SKIN", "TOUCHABLE, 1.0"]
    lines += _tip(subject, tip)
    lines += ["*Boundary", "BASE, ENCASTRE", f"{tip}, 4, 6"]
    move = subject.pressed - subject.start
    lines += ["*Step, name=press, nlgeom=YES, inc=200", "*Static", "0.02, 1.0, 1e-6, 0.05", "*Boundary"]
    lines += [f"{tip}, {axis + 1}, {axis + 1}, {move[axis]:.9g}" for axis in range(3)]
    lines += ["*Output, history", "*Node Output, nset=TIP", "U, RF", "*Output, field, variable=PRESELECT"]
    lines += ["*End Step", ""]
    path.write_text("\n".join(lines), encoding="ascii")
    ranges = [f"moduli in {_RANGES} ranges"] if len(np.unique(subject.element_modulus_pa)) > _RANGES else []
    return (*ranges, "the tip slides without friction")


def _law(subject: Subject, modulus: float) -> list[str]:
    nu = subject.model.material.poisson_ratio
    if subject.model.material.dent_law == "linear":
        return ["*Elastic", f"{modulus:.9g}, {nu:.9g}"]
    c10, d1 = modulus / (4 * (1 + nu)), 6 * (1 - 2 * nu) / modulus
    return ["*Hyperelastic, neo hooke", f"{c10:.9g}, {d1:.9g}"]


def _tip(subject: Subject, node: int) -> list[str]:
    """An analytical rigid sphere about its own axis (two points of it, then the profile)."""
    centre, up, radius = subject.start, subject.normal, subject.radius_m
    a, b = ", ".join(f"{v:.9g}" for v in centre), ", ".join(f"{v:.9g}" for v in centre + up)
    return [
        f"*Nset, nset=TIP\n{node}",
        "*Surface, type=REVOLUTION, name=BALL",
        f"{a}, {b}",
        f"START, 0., {-radius:.9g}",
        f"CIRCL, {radius:.9g}, 0., 0., 0.",
        f"*Rigid Body, analytical surface=BALL, ref node={node}",
        "*Surface Interaction, name=TOUCH",
        "*Contact Pair, interaction=TOUCH, type=NODE TO SURFACE",
        "SKIN, BALL",
    ]


def _grouped(moduli: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(g,) moduli and (m,) the one of each element: as they are, or the geometric middle of equal ranges."""
    values, group = np.unique(moduli, return_inverse=True)
    if len(values) <= _RANGES:
        return values, group
    edges = np.geomspace(values[0], values[-1] * (1 + 1e-9), _RANGES + 1)
    index = np.clip(np.searchsorted(edges, moduli, side="right") - 1, 0, _RANGES - 1)
    used, group = np.unique(index, return_inverse=True)
    return np.sqrt(edges[used] * edges[used + 1]), group


def _wrapped(numbers: np.ndarray) -> list[str]:
    return [", ".join(map(str, numbers[i : i + 16])) for i in range(0, len(numbers), 16)]
