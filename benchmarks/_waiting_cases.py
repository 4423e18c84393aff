"""What one waits for: tissue on a slab as robots probe it, and a machine's curves as it exports them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks._tissue import NU, tissue
from mechanics.recording import Recording

PLACES, ROWS = 110, 10


def robot_probing(seed: int, places: int = PLACES, rows: int = ROWS) -> tuple[Recording, float]:
    """(recording of points without a time, thickness of the slab, m): each place pressed once, in `rows` rows
    from just above the surface to the deepest."""
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
        description={
            "recording": {"quasi_static": True, "force_on": "tool"},
            "object": {"slab_m": slab.about["height_m"], "poisson_ratio": NU},
        },
    )
    return recording, slab.about["height_m"]
