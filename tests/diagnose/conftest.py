"""A small block pressed at twelve places by the mechanics alone: what the diagnosis is tried on quickly."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

from palpate.mechanics.compliance.sites import touch_sites
from palpate.mechanics.contact.touch import touch_force
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.presses.segmentation import FoundPresses, segment_recording
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.shape.tetmesh import TetMesh

MODULUS, NU, RADIUS, NOISE = 20e3, 0.49, 0.005, 0.01


def _block() -> TetMesh:
    x, z = np.linspace(-0.04, 0.04, 5), np.linspace(0, 0.04, 4)
    points = np.array(np.meshgrid(x, x, z, indexing="ij")).reshape(3, -1).T
    index = np.arange(len(points)).reshape(5, 5, 4)
    tets = []
    for i, j, k in itertools.product(range(4), range(4), range(3)):
        for order in itertools.permutations(range(3)):
            corner = [0, 0, 0]
            path = [index[i, j, k]]
            for axis in order:
                corner[axis] = 1
                path.append(index[i + corner[0], j + corner[1], k + corner[2]])
            tets.append(path)
    tets = np.array(tets)
    p = points[tets]
    volume = np.einsum("ij,ij->i", np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), p[:, 3] - p[:, 0])
    tets[volume < 0] = tets[volume < 0][:, [0, 2, 1, 3]]
    fixed = points[:, 2] < 1e-9
    outside = (np.abs(points[:, :2]).max(axis=1) > 0.0399) | (points[:, 2] > 0.0399)
    return TetMesh(points, tets, fixed, outside & ~fixed).quadratic()


class Bench:
    """The block, its places and `record(alter)`: presses of known speeds and depths, altered as a test
    likes."""

    def __init__(self, folder: Path | None = None) -> None:
        """folder: where what the model's places answer is kept, solved once for all tests."""
        self.folder = folder
        self.mesh = _block()
        top = [(x, y, 0.04) for x in (-0.02, 0.0, 0.02) for y in (-0.02, 0.0, 0.02)]
        side = [(0.04, y, 0.022) for y in (-0.018, 0.0, 0.018)]
        self.points = np.array(top + side)
        self.normals = np.array([[0, 0, 1.0]] * len(top) + [[1.0, 0, 0]] * len(side))
        self.sites = touch_sites(self.mesh, self.points, self.normals, NU)

    def record(
        self, alter=None, *, law: str = "neo-hookean", seed: int = 0, tremor_m: float = 0.0
    ) -> tuple[Recording, Model]:
        """(recording, model). alter(t, position, force) -> (position, force) acts before the noise. tremor_m:
        rms along each axis, of 9 Hz."""
        rng = np.random.default_rng(seed)
        clock = 0.0
        rate = 500.0
        times, centres, forces, onsets, peaks = [], [], [], [], []
        presses = [(i, k) for k in range(2) for i in range(len(self.points))]
        for number, (i, _) in enumerate(presses):
            depth = (0.0025, 0.0035, 0.0042)[(number * 7) % 3]
            speed = (0.006, 0.02, 0.06)[number % 3]
            hold = (0.1, 0.5)[number % 2]
            n = self.normals[i]
            ramp = depth / speed
            local = np.arange(0, 0.6 + 2 * ramp + hold + 0.4, 1 / rate)
            before = 0.6
            into = np.interp(
                local, [0, before, before + ramp, before + ramp + hold, before + 2 * ramp + hold],
                [-before * speed, 0, depth, depth, 0],
            )  # fmt: skip
            after = local > before + 2 * ramp + hold
            into[after] = -(local[after] - (before + 2 * ramp + hold)) * speed
            drag = 0.0008 * np.clip(into / depth, 0, 1) * (1 if number % 2 else -1)
            across = np.array([0.0, 1.0, 0.0])
            d = -into[:, None] * n + drag[:, None] * across
            if tremor_m > 0:
                phase = 2 * np.pi * (9 * local[:, None] + rng.uniform(size=3))
                d = d + np.sqrt(2) * tremor_m * np.sin(phase)
            f = touch_force(
                d,
                n,
                self.sites.far[i],
                young_modulus_pa=MODULUS,
                poisson_ratio=NU,
                tip_radius_m=RADIUS,
                curvature=self.sites.curvature[i],
                law=law,
            )
            times.append(clock + local)
            centres.append(self.points[i] + RADIUS * n + d)
            forces.append(f)
            onset = clock + before
            onsets.append(onset)
            peaks.append(onset + ramp)
            clock += local[-1] + 1 / rate
        t, x, f = np.concatenate(times), np.concatenate(centres), np.concatenate(forces)
        if alter is not None:
            x, f = alter(t, x, f)
        f = f + rng.normal(0, NOISE, f.shape)
        recording = Recording(
            t=t, position=x, force_on_tool=f, sample_rate_hz=rate, tip_radius_m=RADIUS, poisson_ratio=NU
        )
        self.known = np.array(onsets), np.array(peaks), np.array([i for i, _ in presses])
        model = Model(
            mesh=self.mesh, material=ObjectMaterial(MODULUS, NU),
            support=Support(np.zeros(3), np.array([0, 0, 1.0])), tool=Tool(RADIUS), mesh_size_m=0.02,
            presses=self.table(recording), path=self.folder,
        )  # fmt: skip
        return recording, model

    def table(self, recording: Recording) -> Presses:
        """The presses of a recording (as `record` made the last one, altered or not), where they are known to
        be."""
        onset, peak, place = self.known
        normal = self.normals[place]
        centre = self.points[place] + RADIUS * normal
        return segment_recording(recording, FoundPresses(onset, peak, centre, normal))


@pytest.fixture(scope="session")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """One block for all tests of this folder."""
    return Bench(tmp_path_factory.mktemp("block"))
