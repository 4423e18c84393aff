"""Tetrahedra inside a closed surface by fTetWild, in a process of its own.

fTetWild leaves a file in the current folder, prints, and cannot be stopped: a child process in a temporary
folder keeps all three away from the caller.
"""

from __future__ import annotations

import contextlib
import math
import os
import signal
import subprocess
import sys
import time
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np

from palpate.mechanics.disk.reading import reading
from palpate.mechanics.disk.scratch import cache_folder
from palpate.mechanics.disk.store import content_key, load_or_build
from palpate.mechanics.disk.writing import temporary_folder
from palpate.mechanics.errors import MeshError
from palpate.mechanics.shape.tetmesh import tet_volumes

MOST_TETRAHEDRA = 150_000
"""Beyond it the factorised stiffness of quadratic elements takes more memory than a desktop has."""
AFFORDABLE, AFFORDABLE_ASKED = 20_000, 45_000
"""So many tetrahedra by volume a model has at most by itself, and where the size was asked for: an organ at
12,000 (28,000 nodes) takes 1.5 GB, at 29,000 2.8 GB and 170 s of processor time. The finer surface that
presses are solved on comes on top, and may take far more."""
_REGULAR = 2**0.5 / 12
_ENERGY, _PASSES = 10.0, 80
"""The optimisation stops at this AMIPS energy (3 is ideal), or after so many passes."""
_WORK_S, _WORK_PER_TETRAHEDRON_S, _STILL_S = 60.0, 0.005, 60.0
"""Processor time that one try may take, and so much more for each tetrahedron (some 1 ms are usual); time by
the clock after which a mesher that takes no processor time is taken for stuck."""
_FIRST = 1 / 3
"""Of it, for the first try; the second has one thread and a simplified drawing."""

_CHILD = """
import contextlib, ctypes, os, signal, sys
with contextlib.suppress(ImportError, ValueError, OSError):
    import resource
    resource.setrlimit(resource.RLIMIT_CPU, (int(sys.argv[2]), int(sys.argv[2])))
if hasattr(signal, "alarm"):
    signal.alarm(60 * int(sys.argv[2]))
with contextlib.suppress(OSError, AttributeError, TypeError):
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)
    if os.getppid() != int(sys.argv[1]):
        sys.exit(1)
import numpy as np, pytetwild
given = np.load("surface.npz")
settings = {name: given[name].item() for name in given.files if name not in ("vertices", "triangles")}
points, cells = pytetwild.tetrahedralize(given["vertices"], given["triangles"], **settings)
np.savez("mesh.npz", points=points, cells=cells)
"""
"""Arguments: the parent's id, with which it ends (Linux: PR_SET_PDEATHSIG), and s of processor time after
which it ends anyway. Signals do it, as the mesher lets no Python run beside it."""


class MeshTooDear(MeshError):
    """A size of tetrahedra takes more work than is allowed; a larger one takes less."""


def tetrahedralize(
    vertices: np.ndarray,
    triangles: np.ndarray,
    *,
    edge_m: float,
    envelope_m: float,
    simplify: bool = True,
    threads: int | None = None,
    passes: int = _PASSES,
    take: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (n, 3) m and positive tetrahedra (m, 4), VTK order, of the solid inside a closed surface.

    fTetWild shuffles by a seed that nobody can set (its issue 72), so what was meshed once is kept in the
    cache: the same drawing gives the same tetrahedra.

    edge_m: wanted edge length. envelope_m: greatest distance of the mesh's surface from the given one.
    simplify: merge triangles within the envelope first; a drawing as coarse as the tetrahedra needs none,
    and comes out better in half the time. threads: None takes OMP_NUM_THREADS, without it all cores. passes:
    of optimisation at most; few where their surface alone is wanted. take: another one is another mesh of the
    same drawing. Raises MeshError where nothing comes back, MeshTooDear where that is for the size.
    """
    check_count(vertices, triangles, edge_m)
    key = content_key(
        "tetrahedra 1",
        version("pytetwild"),
        vertices,
        triangles,
        edge_m,
        envelope_m,
        simplify,
        passes,
        take,
    )
    mesh = partial(_meshed, vertices, triangles, edge_m, envelope_m, simplify, threads, passes)
    kept = load_or_build(cache_folder() / "tetrahedra" / f"{key[:24]}.bin", key, mesh)
    return np.array(kept["points"]), np.array(kept["cells"])


def _meshed(
    vertices: np.ndarray,
    triangles: np.ndarray,
    edge_m: float,
    envelope_m: float,
    simplify: bool,
    threads: int | None,
    passes: int,
) -> dict[str, np.ndarray]:
    work_s = _WORK_S + _WORK_PER_TETRAHEDRON_S * tetrahedra(vertices, triangles, edge_m)
    if threads is None:
        threads = int(os.environ.get("OMP_NUM_THREADS", "").split(",")[0] or 0)
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    with temporary_folder("mesh-") as folder:
        # now and then its threads wait for each other for ever, or it refines a drawing for ever that it was
        # not let simplify (seen: an L of 617 points); one thread on a simplified one does neither
        for count, merges, limit_s in ((threads, simplify, _FIRST * work_s), (1, True, work_s)):
            np.savez(
                folder / "surface.npz",
                vertices=np.asarray(vertices, dtype=np.float64),
                triangles=np.asarray(triangles, dtype=np.int32),
                edge_length_abs=edge_m,
                epsilon=envelope_m / diagonal,
                simplify=merges,
                stop_energy=_ENERGY,
                num_opt_iter=passes,
                num_threads=count,
            )
            ended = _ended(folder, limit_s)
            if ended is not None:
                break
        if ended is None:
            raise MeshTooDear(
                f"the mesher did not end within {work_s:.0f} s of processor time: use a larger --mesh-size "
                f"than {edge_m:g} m"
            )
        result = folder / "mesh.npz"
        if ended or not result.is_file():
            words = (folder / "said").read_text(errors="replace").strip().splitlines()
            raise MeshError(f"the mesher gave no mesh ({words[-1] if words else f'exit {ended}'})")
        with reading(result, MeshError), np.load(result, allow_pickle=False) as found:
            points, cells = found["points"], found["cells"].astype(np.int64)
    if not len(cells):
        raise MeshError(f"the mesher gave no tetrahedra: --mesh-size {edge_m} m does not fit the object")
    turned = tet_volumes(points, cells) < 0
    cells[turned] = cells[turned][:, [0, 2, 1, 3]]
    return {"points": points, "cells": cells}


def _ended(folder: Path, limit_s: float) -> int | None:
    """The mesher's exit code; None where it took `limit_s` of processor time, or stood still."""
    words = [sys.executable, "-c", _CHILD, str(os.getpid()), str(math.ceil(limit_s))]
    with (
        (folder / "said").open("wb") as said,
        subprocess.Popen(words, cwd=folder, stdout=subprocess.DEVNULL, stderr=said) as child,
    ):
        try:
            taken_s, since = 0.0, time.monotonic()
            while True:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    code = child.wait(1.0)
                    return None if code in _STOPPED else code
                now_s = _processor_time(child.pid)
                if now_s is None or now_s > taken_s:
                    taken_s, since = now_s or 0.0, since if now_s is None else time.monotonic()
                # where the system does not tell processor time, the clock has to do
                if time.monotonic() - since > (limit_s if now_s is None else _STILL_S):
                    return None
        finally:
            child.kill()


_STOPPED = tuple(
    -getattr(signal, name) for name in ("SIGXCPU", "SIGKILL", "SIGALRM") if hasattr(signal, name)
)
"""How a mesher ends that took its time."""


def _processor_time(process: int) -> float | None:
    """Processor time, s, of a process; None where the system does not say (no /proc)."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    except (OSError, IndexError):
        return None
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def tetrahedra(vertices: np.ndarray, triangles: np.ndarray, edge_m: float) -> float:
    """About how many tetrahedra of an edge length fill a closed surface."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    volume = abs(float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum())) / 6
    return volume / (_REGULAR * edge_m**3)


def affordable(vertices: np.ndarray, triangles: np.ndarray, edge_m: float, most: int = AFFORDABLE) -> float:
    """The edge length, m, nearest to a wished one of at most so many tetrahedra."""
    return edge_m * max(1.0, tetrahedra(vertices, triangles, edge_m) / most) ** (1 / 3)


def check_count(vertices: np.ndarray, triangles: np.ndarray, edge_m: float) -> None:
    """Raise MeshError where a closed surface would take more than MOST_TETRAHEDRA of that edge length."""
    count = tetrahedra(vertices, triangles, edge_m)
    if count > MOST_TETRAHEDRA:
        size = np.ptp(vertices, axis=0)
        least = edge_m * (count / MOST_TETRAHEDRA) ** (1 / 3)
        raise MeshError(
            f"an object of {' x '.join(f'{1e3 * x:.0f}' for x in size)} mm would take about {count:.2g} "
            f"tetrahedra of {1e3 * edge_m:g} mm, {MOST_TETRAHEDRA} are allowed: use --mesh-size "
            f"{least * 1.05:.2g}, or check that the positions are in metres"
        )
