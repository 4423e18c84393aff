"""Files and situations that nobody had tried first: tips of other forms, slow curves and robots' logs, words
beside numbers, tests side by side, no time, meshes of several parts, another simulator's forces in a frame of
its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from palpate.diagnosis.other_simulator.frame import UNITS, turned
from palpate.mechanics.contact.tip import Tip
from palpate.mechanics.quantities import parse_unit
from tests.support.exports import Export

KINDS = ("tip", "slow", "words", "beside", "timeless", "parts", "frame", "log")
_AXES = ("x,y,z", "x,z,-y", "x,-z,y", "y,z,x", "z,x,y", "-y,x,z", "x,y,-z", "y,x,z")


def strange_export(folder: Path, seed: int) -> Export:
    """One of that seed in a folder."""
    rng = np.random.default_rng([33, seed])
    kind = KINDS[seed % len(KINDS)]
    if kind == "parts":
        return _parts(folder, seed, rng)
    if kind == "frame":
        return _frame(folder, seed, rng)
    if kind == "log":
        return _log(folder, seed, rng)
    return _curves(folder, seed, rng, kind)


def _curves(folder: Path, seed: int, rng: np.random.Generator, kind: str) -> Export:
    """Presses of a machine as a table in text."""
    form = str(rng.choice(["punch", "cone", "pyramid", "sphere"])) if kind == "tip" else "sphere"
    radius, angle = float(rng.choice([1e-3, 2e-3, 5e-3])), float(rng.choice([18.0, 35.0, 45.0]))
    pointed = form in ("cone", "pyramid")
    tip = Tip(form, half_angle_deg=angle) if pointed else Tip(form, radius)
    modulus = float(np.exp(rng.uniform(np.log(3e3), np.log(1e6))))
    rate = float(rng.choice([10.0, 15.0, 20.0])) if kind == "slow" else float(rng.choice([20.0, 50.0, 100.0]))
    seconds = float(rng.uniform(2.5, 5)) if kind == "slow" else 4.0
    tests = int(rng.integers(2, 5)) if kind == "beside" else 1
    deepest = radius * rng.uniform(0.15, 0.35)
    blocks = []
    for _ in range(tests):
        way = np.linspace(-deepest * rng.uniform(0.3, 0.6), deepest, int(seconds * rate))
        travel = np.concatenate([way, way[::-1]])
        force = tip.force(tip.laws[0], np.maximum(travel, 0.0), modulus, 0.49)
        force = force + 0.004 * force.max() * rng.standard_normal(len(force))
        blocks.append(
            np.column_stack([np.arange(len(travel)) / rate, 1e3 * (travel - travel[0]), 1e3 * force])
        )
    names = [
        ["Time (s)", "Distance (mm)", "Force (mN)"],
        ["t [s]", "Extension [mm]", "Load [mN]"],
        ["Time (s)", "Compressive extension (mm)", "Compressive load (mN)"],
    ][rng.integers(3)]
    rows = [[f"{v:.7g}" for v in np.concatenate(row)] for row in zip(*blocks, strict=True)]
    head = names * tests
    if kind == "timeless":
        head, rows = head[1:], [row[1:] for row in rows]
    if kind == "words":
        head, rows = _with_words(head, rows, rng)
    path = folder / f"{kind}-{seed}.csv"
    path.write_text("\n".join(",".join(row) for row in [head, *rows]) + "\n", encoding="utf-8")
    said: dict[str, object] = {}
    stated = bool(rng.random() < 0.5)
    if pointed and stated:
        said = {"tip": form, "tip_angle_deg": angle}
    elif stated:
        said = {"tip": form}
    answers = {"tip": form, "tip_angle_deg": angle if pointed else None, "travel": "into"}
    traits = {"strange": kind, "form": form, "rate": rate, "stated": stated, "tests": tests,
              "answers": answers | {"compression": "positive", "clock": "blocks"}}  # fmt: skip
    return Export(
        path, "curves", None if said.get("tip_angle_deg") else radius, modulus, traits=traits, said=said
    )


_NAMES = (
    "t x y z fx fy fz",
    "timestamp tcp_x tcp_y tcp_z ft_force_x ft_force_y ft_force_z",
    "time ee_pose_x ee_pose_y ee_pose_z wrench_fx wrench_fy wrench_fz",
    "t O_T_EE_12 O_T_EE_13 O_T_EE_14 O_F_ext_hat_K_0 O_F_ext_hat_K_1 O_F_ext_hat_K_2",
)


def _log(folder: Path, seed: int, rng: np.random.Generator) -> Export:
    """A robot's presses of something flat and deep, at 10 to 40 Hz, with words beside; three of four by a
    sphere."""
    form = str(rng.choice(["sphere", "sphere", "sphere", "punch", "cone", "sphere"]))
    radius, modulus = (
        float(rng.choice([3e-3, 4e-3, 5e-3])),
        float(np.exp(rng.uniform(np.log(5e3), np.log(1e5)))),
    )
    tip = Tip(form, half_angle_deg=45.0) if form == "cone" else Tip(form, radius)
    rate, count, speed = float(rng.choice([10, 20, 40])), int(rng.integers(5, 10)), 5e-3
    deep, air = radius * rng.uniform(0.4, 0.8), rng.uniform(1.5e-3, 3e-3)
    lasts = 2 * (deep + air) / speed
    t = np.arange(0, count * lasts, 1 / rate)
    place, within = np.divmod(t, lasts)
    height = speed * np.abs(within - lasts / 2) - deep
    push = tip.force(tip.laws[0], -height, modulus, 0.49)
    force = rng.uniform(5e-4, 3e-3) * push.max() * rng.standard_normal((len(t), 3))
    force[:, 2] += push
    whose, length = str(rng.choice(["tool", "object"])), str(rng.choice(["m", "mm"]))
    position = np.column_stack([0.012 * (place // 3), 0.012 * (place % 3), height + radius])
    table = np.column_stack([t, position / parse_unit(length).scale, force if whose == "tool" else -force])
    head, rows = _NAMES[rng.integers(len(_NAMES))].split(), [[f"{v:.7g}" for v in row] for row in table]
    if rng.random() < 0.5:
        head, rows = _with_words(head, rows, rng)
    path = folder / f"log-{seed}.csv"
    path.write_text("\n".join(",".join(row) for row in [head, *rows]) + "\n", encoding="utf-8")
    answers = {"tip": form, "force_on": whose, "units": {"position": length, "time": "s", "force": "N"}}
    traits = {"strange": "log", "form": form, "rate": rate, "count": count, "answers": answers}
    return Export(path, "log", radius, modulus, traits=traits)


def _with_words(
    head: list[str], rows: list[list[str]], rng: np.random.Generator
) -> tuple[list[str], list[list[str]]]:
    """With columns of words, booleans, stamps and empty cells at places of their own."""
    phases = ["approach"] * (len(rows) // 2) + ["retract"] * (len(rows) - len(rows) // 2)
    more = {
        "phase": phases,
        "contact": [str(k % 3 > 0) for k in range(len(rows))],
        "date": [f"2026-03-01T10:00:{k % 60:02d}.{k % 10}00" for k in range(len(rows))],
        "remark": ["" if k % 7 else "ok" for k in range(len(rows))],
    }
    for name in rng.choice(list(more), int(rng.integers(1, 4)), replace=False):
        at = int(rng.integers(len(head) + 1))
        head = [*head[:at], str(name), *head[at:]]
        rows = [[*row[:at], cell, *row[at:]] for row, cell in zip(rows, more[str(name)], strict=True)]
    return head, rows


def _parts(folder: Path, seed: int, rng: np.random.Generator) -> Export:
    """A block of 60 x 60 x 30 mm with a ball in it, or two blocks beside one another, as an OBJ in mm."""
    block = trimesh.creation.box(extents=(60, 60, 30))
    if rng.random() < 0.5:
        other = trimesh.creation.icosphere(subdivisions=2, radius=rng.uniform(4, 9))
        other.apply_translation([*rng.uniform(-12, 12, 2), 0])
    else:
        other = trimesh.creation.box(extents=(40, 40, 30))
        other.apply_translation([rng.uniform(60, 80), 0, 0])
    lines, before = [], 1
    for name, body in (("liver", block), ("tumour", other)):
        lines.append(f"o {name}")
        lines += ["v {:.6f} {:.6f} {:.6f}".format(*v) for v in body.vertices]
        lines += ["f {} {} {}".format(*(f + before)) for f in body.faces]
        before += len(body.vertices)
    path = folder / f"parts-{seed}.obj"
    path.write_text("\n".join(lines) + "\n")
    inside = other.bounds[1][0] < 30
    volumes = (108.0 - inside * float(other.volume) / 1e3, float(other.volume) / 1e3)
    moduli = {"liver": 5e3, "tumour": 4e4}
    traits = {"strange": "parts", "volumes_cm3": volumes, "answers": {"modulus": moduli}}
    return Export(path, "parts", None, traits=traits)


def _frame(folder: Path, seed: int, rng: np.random.Generator) -> Export:
    """Forces of another simulator along the demo's presses, in axes and a unit of their own."""
    import palpate as pp

    presses = pp.load("demo", progress=False).presses
    axes, unit = str(rng.choice(_AXES)), str(rng.choice(UNITS))
    right = (presses.force - presses.free_air) * float(np.exp(0.2 * rng.standard_normal()))
    right = right + 0.05 * np.abs(right).max() * rng.standard_normal(right.shape)
    path = folder / f"frame-{seed}.npy"
    np.save(path, right @ turned(axes).T / parse_unit(unit).scale)
    return Export(
        path,
        "frame",
        None,
        traits={"strange": "frame", "answers": {"simulated-axes": axes, "simulated-unit": unit}},
    )
