"""What one waits for: tissue on a slab as robots probe it, and a machine's curves as it exports them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks._tissue import NU, tissue
from palpate.mechanics.disk.toml_text import dump_toml
from palpate.mechanics.recording.recording import Recording, description_table

PLACES, ROWS = 110, 10
CURVES, CURVE_ROWS, CURVE_TIP_M = 9, 5000, 1e-3


def robot_probing(folder: Path, seed: int, places: int = PLACES, rows: int = ROWS) -> Path:
    """The recording of points without a time over a slab of known thickness, written to a folder: each place
    pressed once, in `rows` rows from just above the surface to the deepest."""
    slab = tissue(seed, raster=int(np.ceil(np.sqrt(places))))
    presses = slab.presses
    each = int(np.diff(presses.starts)[0])
    chosen = np.linspace(1, each // 2 - 1, rows).round().astype(int)
    at = (presses.starts[:places, None] + chosen).ravel()
    recording = Recording(
        t=np.arange(len(at)) / 100.0,
        position=presses.position[at],
        force_on_tool=presses.force[at],
        sample_rate_hz=100.0,
        tip_radius_m=presses.tip_radius_m,
        force_noise_std_n=slab.about["noise_n"],
        object_name="slab",
        poisson_ratio=NU,
    )
    path = recording.save(folder / "robot.csv")
    told = description_table(recording)
    told["recording"]["quasi_static"] = True
    told["object"]["slab_m"] = slab.about["height_m"]
    path.with_suffix(".toml").write_text(dump_toml(told), encoding="utf-8")
    return path


def machine_curves(folder: Path, seed: int, curves: int = CURVES, rows: int = CURVE_ROWS) -> list[Path]:
    """Tables of a sphere's indentations at one place: in, held, out, in 5 s each; a solid that relaxes."""
    random, files = np.random.default_rng(seed), []
    radius, modulus, share, tau = CURVE_TIP_M, 30e3, 0.3, 0.5
    for k in range(curves):
        t = np.linspace(0.0, 5.0, rows)
        deepest = random.uniform(1.6e-4, 2.4e-4)
        depth = np.interp(t, [0.0, 0.5, 1.5, 3.5, 4.5, 5.0], [-2e-5, -2e-5, deepest, deepest, -2e-5, -2e-5])
        spring = 4 / 3 * modulus / (1 - NU**2) * np.sqrt(radius) * np.maximum(depth, 0.0) ** 1.5
        memory, keeps = np.zeros(rows), np.exp(-(t[1] - t[0]) / tau)
        for i in range(1, rows):
            memory[i] = keeps * memory[i - 1] + share * (spring[i] - spring[i - 1])
        force = (1 - share) * spring + memory + 2e-5 * random.standard_normal(rows)
        path = folder / f"curve_{k + 1}.csv"
        table = np.column_stack([t, 1e6 * depth, 1e3 * force])
        np.savetxt(path, table, "%.6g", ",", header="Time (s),Indentation (um),Load (mN)", comments="")
        files.append(path)
    return files
