"""Tetrahedra inside a closed surface by fTetWild, in a process of its own.

fTetWild leaves a file in the current folder, prints, and cannot be stopped: a child process in a temporary
folder keeps all three away from the caller.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys

import numpy as np

from palpate.mechanics.disk.reading import reading
from palpate.mechanics.disk.writing import temporary_folder
from palpate.mechanics.errors import MeshError

MOST_TETRAHEDRA = 150_000
"""Beyond it the factorised stiffness of quadratic elements takes more memory than a desktop has."""
_REGULAR = 2**0.5 / 12
_ENERGY, _PASSES = 10.0, 80
"""The optimisation stops at this AMIPS energy (3 is ideal), or after so many passes."""
_TIMEOUT_S = 300.0
"""For the second try, with one thread and simplified; the first has a third of it."""

_CHILD = """
import contextlib, ctypes, os, signal, sys
if hasattr(signal, "alarm"):
    signal.alarm(int(sys.argv[2]) + 10)
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
"""Arguments: the parent's id, with which it ends (Linux: PR_SET_PDEATHSIG), and s after which it ends anyway.
Signals do it, as the mesher lets no Python run beside it."""


def tetrahedralize(
    vertices: np.ndarray,
    triangles: np.ndarray,
    *,
    edge_m: float,
    envelope_m: float,
    simplify: bool = True,
    threads: int | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (n, 3) m and positive tetrahedra (m, 4), VTK order, of the solid inside a closed surface.

    edge_m: wanted edge length. envelope_m: greatest distance of the mesh's surface from the given one.
    simplify: merge triangles within the envelope first; a drawing as coarse as the tetrahedra needs none,
    and comes out better in half the time. threads: None takes OMP_NUM_THREADS, without it all cores. Raises
    MeshError where nothing comes back.
    """
    check_count(vertices, triangles, edge_m)
    if threads is None:
        threads = int(os.environ.get("OMP_NUM_THREADS", "").split(",")[0] or 0)
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    with temporary_folder("mesh-") as folder:
        done = None
        # now and then its threads wait for each other for ever, or it refines a drawing for ever that it was
        # not let simplify (seen: an L of 617 points); one thread on a simplified one does neither
        for count, merges, limit_s in ((threads, simplify, _TIMEOUT_S / 3), (1, True, _TIMEOUT_S)):
            np.savez(
                folder / "surface.npz",
                vertices=np.asarray(vertices, dtype=np.float64),
                triangles=np.asarray(triangles, dtype=np.int32),
                edge_length_abs=edge_m,
                epsilon=envelope_m / diagonal,
                simplify=merges,
                stop_energy=_ENERGY,
                num_opt_iter=_PASSES,
                num_threads=count,
            )
            with contextlib.suppress(subprocess.TimeoutExpired):
                done = subprocess.run(
                    [sys.executable, "-c", _CHILD, str(os.getpid()), str(round(limit_s))],
                    cwd=folder,
                    capture_output=True,
                    timeout=limit_s,
                    check=False,
                )
                break
        if done is None:
            raise MeshError(
                f"the mesher did not end within {_TIMEOUT_S:.0f} s: use a larger --mesh-size than {edge_m} m"
            )
        result = folder / "mesh.npz"
        if done.returncode or not result.is_file():
            words = done.stderr.decode(errors="replace").strip().splitlines()
            raise MeshError(f"the mesher gave no mesh ({words[-1] if words else f'exit {done.returncode}'})")
        with reading(result, MeshError), np.load(result, allow_pickle=False) as found:
            points, cells = found["points"], found["cells"].astype(np.int64)
    if not len(cells):
        raise MeshError(f"the mesher gave no tetrahedra: --mesh-size {edge_m} m does not fit the object")
    corner = points[cells]
    volume = np.einsum(
        "ij,ij->i",
        np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]),
        corner[:, 3] - corner[:, 0],
    )
    cells[volume < 0] = cells[volume < 0][:, [0, 2, 1, 3]]
    return points, cells


def check_count(vertices: np.ndarray, triangles: np.ndarray, edge_m: float) -> None:
    """Raise MeshError where a closed surface would take more than MOST_TETRAHEDRA of that edge length."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    volume = abs(float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum())) / 6
    count = volume / (_REGULAR * edge_m**3)
    if count > MOST_TETRAHEDRA:
        size = np.ptp(vertices, axis=0)
        least = (volume / (_REGULAR * MOST_TETRAHEDRA)) ** (1 / 3)
        raise MeshError(
            f"an object of {' x '.join(f'{1e3 * x:.0f}' for x in size)} mm would take about {count:.2g} "
            f"tetrahedra of {1e3 * edge_m:g} mm, {MOST_TETRAHEDRA} are allowed: use --mesh-size "
            f"{least * 1.05:.2g}, or check that the positions are in metres"
        )
