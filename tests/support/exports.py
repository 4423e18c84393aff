"""Files as people export them: machines' curves and robots' logs, with units, signs, axes, separators,
decimal signs, headers, clocks and kinds of file varied at random, and what they hold in truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.contact.dent import dent_law
from tests.support.containers import WRITERS, Content

_LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6}
_FORCES = {"N": 1.0, "mN": 1e-3, "gf": 9.80665e-3}
_TIMES = {"s": 1.0, "ms": 1e-3}


@dataclass(frozen=True)
class Export:
    """A file. kind: "curves" or "recording", of strange ones also "parts" or "frame"; young_modulus_pa: of
    curves; force_on_tool (n, 3) N: of a recording; tip_radius_m: stated beside the file (None: the file's own
    text says it); traits: how it was written."""

    path: Path
    kind: str
    tip_radius_m: float | None
    young_modulus_pa: float | None = None
    position: np.ndarray | None = None
    force_on_tool: np.ndarray | None = None
    traits: Mapping[str, Any] = field(default_factory=dict)
    columns: Mapping[str, str] = field(default_factory=dict)
    """Said beside a file whose columns have no names."""
    units: Mapping[str, str] = field(default_factory=dict)
    said: Mapping[str, Any] = field(default_factory=dict)
    """Said beside a file, by name of `pp.material`."""


CONTAINERS = {
    "curves": ("text", "text", "xlsx", "ods", "npz", "npy", "mat"),
    "recording": ("text", "xlsx", "ods", "npz", "npy", "mat", "bag", "mcap"),
}
"""Kinds of file that are drawn from, by what they hold."""


def export(folder: Path, seed: int, *, mixed: bool = False) -> Export:
    """One file of that seed in a folder: two of three are a machine's. mixed: of any kind, not text alone."""
    rng = np.random.default_rng([31, seed])
    kind = "curves" if seed % 3 else "recording"
    container = "text"
    if mixed:
        container = str(np.random.default_rng([32, seed]).choice(CONTAINERS[kind]))
    make = machine_export if kind == "curves" else robot_export
    return make(folder, seed, rng, container)


def machine_press(
    rng: np.random.Generator, modulus: float, radius: float, *, hold: bool, air: bool, seconds: float = 8.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(t s, travel into the sample m, force that pushes out N) of one press of a sphere that loses some work
    and relaxes in a hold."""
    rate = rng.choice([20.0, 50.0, 100.0])
    deepest = radius * rng.uniform(0.15, 0.35)
    start = -deepest * (rng.uniform(0.15, 0.5) if air else 0.0)
    ways = [np.linspace(start, deepest, int(seconds / 2 * rate))]
    if hold:
        ways.append(np.full(int(seconds / 2 * rate), deepest))
    ways.append(np.linspace(deepest, start, int(seconds / 2 * rate)))
    travel = np.concatenate(ways)
    t = np.arange(len(travel)) / rate
    lag = np.concatenate([np.zeros(len(ways[0])), *(np.full(len(w), 0.04 * deepest) for w in ways[1:])])
    force = np.asarray(dent_law("sphere").force(np.maximum(travel - lag, 0.0), modulus, 0.49, radius))
    if hold:
        begun = len(ways[0])
        relaxed = 1 - 0.15 * (1 - np.exp(-np.maximum(np.arange(len(t)) - begun, 0) / (rate * 1.5)))
        force = force * relaxed
    force = force + 0.004 * force.max() * rng.standard_normal(len(force))
    return t, travel, force


def machine_export(folder: Path, seed: int, rng: np.random.Generator, container: str = "text") -> Export:
    """A bench machine's file: one press, or blocks with clocks of their own."""
    radius = float(rng.choice([1e-3, 2e-3, 3e-3, 5e-3, 10e-3]))
    modulus = float(np.exp(rng.uniform(np.log(3e3), np.log(3e6))))
    blocks = int(rng.choice([1, 1, 1, 3, 4]))
    hold, air = bool(rng.random() < 0.4), bool(rng.random() < 0.85)
    parts = [machine_press(rng, modulus, radius, hold=hold, air=air) for _ in range(blocks)]
    restarts = bool(rng.random() < 0.6)
    clocks, end = [], 0.0
    for t, _, _ in parts:
        clocks.append(t if restarts else t + end)
        end += t[-1] + 0.5
    t = np.concatenate(clocks)
    travel = np.concatenate([p[1] for p in parts])
    force = np.concatenate([p[2] for p in parts])
    if blocks == 1 and rng.random() < 0.15:
        order = np.argsort(np.arange(len(t)) + rng.integers(0, 6, len(t)), kind="stable")
        t, travel, force = t[order], travel[order], force[order]
    counts, sign = rng.choice([1, -1], p=[0.6, 0.4]), rng.choice([1, -1], p=[0.65, 0.35])
    names = ["Depth", "Displacement", "Position", "Extension"] if counts > 0 else [
        "Height", "Gap", "Position", "Displacement", "Z",
    ]  # fmt: skip
    name, load = str(rng.choice(names)), str(rng.choice(["Load", "Force", "Fz", "Kraft"]))
    zero = float(rng.choice([0.0, 0.01, 0.05, -0.02]))
    travel = counts * travel + zero
    force = sign * force + float(rng.choice([0.0, 0.0, 0.1])) * np.abs(force).max()
    units = {
        "t": str(rng.choice(list(_TIMES), p=[0.8, 0.2])),
        "z": str(rng.choice(list(_LENGTHS), p=[0.1, 0.7, 0.1, 0.1])),
        "f": str(rng.choice(list(_FORCES), p=[0.7, 0.2, 0.1])),
    }
    said = bool(rng.random() < 0.85)
    if not said:
        units = {"t": "s", "z": str(rng.choice(["m", "mm"])), "f": "N"}
    table = np.column_stack(
        [t / _TIMES[units["t"]], travel / _LENGTHS[units["z"]], force / _FORCES[units["f"]]]
    )
    head = ["Time", name, load]
    in_file = bool(rng.random() < 0.3)
    path = folder / f"machine-{seed}.{rng.choice(['csv', 'txt'])}"
    remarks = [f"Operator: A. Nother {seed}", "Sample: gel"]
    if in_file:
        remarks.append(f"Probe radius: {1e3 * radius:g} mm")
    written = Content(head, [units["t"], units["z"], units["f"]] if said else None, table, remarks)
    made = _as(container, path, rng, written, ("t", "depth" if counts > 0 else "height", "load"))
    # words beside the numbers are in texts and sheets alone
    in_file = in_file and container in ("text", "xlsx", "ods")
    traits = {"travel": int(counts), "load": int(sign), "units": units if said else "unsaid", "air": air,
              "answers": _answers(units, restarts, travel=counts, load=sign),
              "hold": hold, "blocks": blocks, "restarts": restarts, "name": name, **made.style}  # fmt: skip
    return Export(
        made.path, "curves", None if in_file else radius, young_modulus_pa=modulus, traits=traits,
        columns=made.columns, units=made.units,
    )  # fmt: skip


def robot_export(folder: Path, seed: int, rng: np.random.Generator, container: str = "text") -> Export:
    """A robot's log: presses on a dome, force of the tool or on the object, a frame turned by quarters."""
    rate, radius = float(rng.choice([100.0, 250.0])), float(rng.choice([3e-3, 4e-3, 5e-3]))
    stiffness = float(rng.uniform(200, 1500))
    count = int(rng.integers(4, 9))
    t = np.arange(int(count * 1.5 * rate)) / rate
    phase = np.mod(t, 1.5) / 1.5
    depth = 0.008 * np.sin(2 * np.pi * phase) - 0.002
    number = np.floor(t / 1.5)
    place = np.column_stack([0.012 * number, 0.004 * np.sin(number), 0.05 - depth])
    press = np.maximum(depth, 0.0)
    force = np.column_stack([0.05 * stiffness * press, 0 * press, stiffness * press])
    force += 0.01 * rng.standard_normal(force.shape)
    turn = np.eye(3)[:, rng.permutation(3)] * rng.choice([1, -1], 3)
    if np.linalg.det(turn) < 0:
        turn[:, 0] *= -1
    place, force = place @ turn.T, force @ turn.T
    on_object = bool(rng.random() < 0.5)
    units = {"t": str(rng.choice(list(_TIMES))), "z": str(rng.choice(["m", "mm"])), "f": "N"}
    said = bool(rng.random() < 0.85)
    table = np.column_stack([
        t / _TIMES[units["t"]], place / _LENGTHS[units["z"]], (-force if on_object else force),
    ])  # fmt: skip
    if not said:
        units["t"] = "s"
        table[:, 0] = t
    path = folder / f"robot-{seed}.csv"
    stem = [["x", "y", "z"], ["pos_x", "pos_y", "pos_z"], ["tcp_x", "tcp_y", "tcp_z"]][rng.integers(3)]
    head = [str(rng.choice(["t", "time", "timestamp"])), *stem, "fx", "fy", "fz"]
    of_each = [units["t"], *[units["z"]] * 3, *[units["f"]] * 3]
    if container in ("bag", "mcap"):  # by their standard in m, N, s
        table = np.column_stack([t, place, -force if on_object else force])
    written = Content(head, of_each if said else None, table, [])
    made = _as(container, path, rng, written, ("t", "x", "y", "z", "fx", "fy", "fz"))
    whose = "object" if on_object else "tool"
    traits = {"force_on": whose, "units": units if said else "unsaid", **made.style,
              "answers": {**_answers(units, False), "force_on": whose}}  # fmt: skip
    return Export(
        made.path, "recording", radius, position=place, force_on_tool=force, traits=traits,
        columns=made.columns, units=made.units,
    )  # fmt: skip


def _answers(units: Mapping[str, str], restarts: bool, *, travel: int = 1, load: int = 1) -> dict[str, Any]:
    """What the owner of a file would answer, by the option that is asked for."""
    return {
        "units": {"time": units["t"], "position": units["z"], "force": units["f"]},
        "clock": "blocks" if restarts else "one",
        "travel": "into" if travel > 0 else "out",
        "compression": "positive" if load > 0 else "negative",
    }


@dataclass(frozen=True)
class _Written:
    path: Path
    style: dict[str, Any]
    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)


_KINDS = {"t": "time", "f": "force", "l": "force"}


def _as(
    container: str, path: Path, rng: np.random.Generator, content: Content, roles: Sequence[str]
) -> _Written:
    """The file in that container. A plain NumPy array has no names: its owner says columns and units."""
    if container == "text":
        style = _write(path, rng, content.head, content.units, content.table, content.remarks)
        return _Written(path, style)
    plain = container == "npy" and bool(rng.random() < 0.5)
    path = path.with_suffix("" if container == "bag" else f".{container}")
    WRITERS[container](path, content, int(rng.integers(3)), plain)
    style = {"container": container, "plain": plain}
    if not plain:
        return _Written(path, style)
    columns = {role: f"#{k + 1}" for k, role in enumerate(roles)}
    units = {} if content.units is None else {
        _KINDS.get(role[0], "position"): unit for role, unit in zip(roles, content.units, strict=True)
    }  # fmt: skip
    return _Written(path, style, columns, units)


def _write(
    path: Path, rng: np.random.Generator, head: Sequence[str], units: Sequence[str] | None,
    table: np.ndarray, remarks: Sequence[str],
) -> dict[str, Any]:  # fmt: skip
    """Write a table in some style; the style."""
    separator, comma = [(",", False), (";", False), (";", True), ("\t", False), ("\t", True)][rng.integers(5)]
    form = int(rng.integers(3))
    lines = list(remarks)
    if units is None:
        lines.append(separator.join(head))
    elif form == 0:
        lines.append(separator.join(f"{h} [{u}]" for h, u in zip(head, units, strict=True)))
    elif form == 1:
        lines.append(separator.join(f"{h} ({u})" for h, u in zip(head, units, strict=True)))
    else:
        lines += [separator.join(head), separator.join(units)]
    for row in table:
        text = separator.join(f"{v:.7g}" for v in row)
        lines.append(text.replace(".", ",") if comma else text)
    path.write_text("\n".join(lines) + "\n", encoding=str(rng.choice(["utf-8", "utf-8-sig"])))
    return {"separator": separator, "comma": comma}
