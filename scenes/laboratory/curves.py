"""Force along a tip's path, solved once for a content and then kept: what seeds, moduli and timing share."""

from __future__ import annotations

import hashlib
import os
import signal
import sys
import threading
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from pathlib import Path
from types import ModuleType

import numpy as np

from palpate.mechanics.disk.writing import atomic_file, check_room
from palpate.mechanics.progress import Progress, silent
from palpate.scenes.laboratory.mesh import coarse_mesh, laboratory_cache, surface_key
from palpate.scenes.laboratory.solver import LabError, LinearProblem
from palpate.scenes.laboratory.specimen import Fineness, Specimen, build
from palpate.scenes.phantoms import Phantom

LOADING = np.array([0.0, 0.03, 0.08, 0.16, 0.26, 0.38, 0.51, 0.64, 0.78, 0.9, 1.0])
"""States that are kept of a straight press, as shares of its greatest depth."""

ROOM_BYTES = 1 << 24
"""That solved touches and a mesh may need in the cache."""

LINEAR_STEP_MM = 0.2
"""Longest load step on the condensed object, where a step costs milliseconds."""


@dataclass(frozen=True)
class SolvedPath:
    """A solved path. travel: (k, 3) mm, the tip's centre since first touch; force: (k, 3) E mm^2, on the
    tip.

    stiffness: (k, 3, 3) E mm, d(force on the tip)/d(tip position) with the contact as it is (negative
    definite; zero where there are times). times: (k,) s, for paths whose solid relaxes, or None.
    energy: (k,) E mm^3.
    """

    travel: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    energy: np.ndarray
    times: np.ndarray | None = None

    @property
    def length(self) -> np.ndarray:
        """(k,) mm, path length up to each state."""
        return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(self.travel, axis=0), axis=1))])


@dataclass(frozen=True)
class PathJob:
    """One path to solve: point (3,) mm and unit normal (3,), object frame; travel (k, 3) mm
    from first touch.
    """

    point: np.ndarray
    normal: np.ndarray
    travel: np.ndarray
    times: np.ndarray | None = None

    def key(self, shape: str, specimen: Specimen, fineness: Fineness) -> str:
        """A content key of everything that the solved curve depends on."""
        digest = hashlib.sha256(f"{shape} {specimen.key()} {fineness}".encode())
        for array in (self.point, self.normal, self.travel, self.times):
            if array is not None:
                digest.update(np.round(np.asarray(array) * 1e4).astype(np.int64).tobytes())
        return digest.hexdigest()[:32]


@dataclass(frozen=True)
class Solving:
    """How touches are solved.

    workers: processes, None: one a core. cache: where solved touches are kept, None: the user's. label: what
    `progress` is told of.
    """

    workers: int | None = None
    cache: Path | None = None
    progress: Progress = silent
    fineness: Fineness = Fineness()
    label: str = "solving touches"


EVERY_CORE, ALONE = Solving(), Solving(workers=1)
"""By a process a core; in the process that asks."""


def solve(
    phantom: Phantom,
    specimen: Specimen,
    jobs: Sequence[PathJob],
    fineness: Fineness,
    cache: Path | None = None,
) -> Iterator[SolvedPath]:
    """March the tip along each job's path from an untouched solid; the jobs share one place and one mesh.

    Raises LabError where a state finds no equilibrium.
    """
    place = jobs[0].point
    sideways = [job.travel - np.outer(job.travel @ job.normal, job.normal) for job in jobs]
    problem = build(
        phantom,
        specimen,
        place,
        travel=max(float(np.linalg.norm(side, axis=1).max()) for side in sideways),
        fineness=fineness,
        cache=cache,
    )
    longest = LINEAR_STEP_MM if isinstance(problem, LinearProblem) else np.inf
    for job in jobs:
        start = place + specimen.tip_radius * job.normal
        state = problem.rest(start + 1e-3 * job.normal)
        count = len(job.travel)
        force, energy = np.zeros((count, 3)), np.zeros(count)
        stiffness = np.zeros((count, 3, 3))
        for k in range(count):
            if k == 0 and not job.travel[0].any():
                continue
            span = 0.0 if job.times is None else float(job.times[k] - job.times[k - 1])
            before = job.travel[k - 1] if k else np.zeros(3)
            for part, share in _parts(before, job.travel[k], longest):
                state = problem.advance(state, start + part, share * span)
            force[k], energy[k] = state.force, state.energy
            if job.times is None and np.linalg.norm(state.force) > 1e-6:
                stiffness[k] = problem.tip_stiffness(state)
        yield SolvedPath(job.travel, force, stiffness, energy, job.times)


def _parts(before: np.ndarray, after: np.ndarray, longest: float) -> Iterator[tuple[np.ndarray, float]]:
    """(place, share of the way) of equal parts no longer than `longest` mm."""
    count = max(1, int(np.ceil(np.linalg.norm(after - before) / longest - 1e-9)))
    for k in range(1, count + 1):
        yield before + (after - before) * k / count, 1 / count


def _work(
    phantom: Phantom,
    specimen: Specimen,
    jobs: Sequence[PathJob],
    fineness: Fineness,
    cache: Path,
    paths: Sequence[Path],
) -> str | None:
    try:
        for curve, path in zip(solve(phantom, specimen, jobs, fineness, cache), paths, strict=True):
            arrays = {k: getattr(curve, k) for k in ("travel", "force", "stiffness", "energy")}
            if curve.times is not None:
                arrays["times"] = curve.times
            with atomic_file(path) as temporary:
                np.savez(temporary, **arrays)
    except LabError as error:
        return str(error)
    return None


def _load(path: Path) -> SolvedPath | None:
    try:
        with np.load(path, allow_pickle=False) as stored:
            times = stored["times"] if "times" in stored else None
            return SolvedPath(stored["travel"], stored["force"], stored["stiffness"], stored["energy"], times)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error):
        return None


def curves(
    phantom: Phantom,
    specimen: Specimen,
    jobs: Sequence[PathJob],
    solving: Solving = EVERY_CORE,
) -> list[SolvedPath]:
    """Solve the jobs that are not in the cache, in parallel; an interrupted run goes on where it stopped.

    Raises LabError naming the touches that found no equilibrium.
    """
    fineness, progress, label = solving.fineness, solving.progress, solving.label
    cache = solving.cache or laboratory_cache()
    shape = surface_key(phantom)
    paths = [cache / "curves" / shape / f"{job.key(shape, specimen, fineness)}.npz" for job in jobs]
    missing = [k for k, path in enumerate(paths) if _load(path) is None]
    if missing:
        check_room(cache, ROOM_BYTES)
        coarse_mesh(phantom, cache)
        failures = []
        places: dict[bytes, list[int]] = {}
        for k in missing:
            places.setdefault(jobs[k].point.tobytes(), []).append(k)
        groups = list(places.values())
        workers = min(len(groups), solving.workers or os.cpu_count() or 1)
        progress(label, 0.0)
        tasks = [
            (phantom, specimen, [jobs[k] for k in group], fineness, cache, [paths[k] for k in group])
            for group in groups
        ]
        if workers == 1:
            for done, task in enumerate(tasks):
                failures.append(_work(*task))
                progress(label, (done + 1) / len(tasks))
        else:
            with workers_of_ours(workers) as pool:
                futures = [pool.submit(_work, *task) for task in tasks]
                for done, future in enumerate(as_completed(futures)):
                    failures.append(future.result())
                    progress(label, (done + 1) / len(tasks))
        failures = [failure for failure in failures if failure]
        if failures:
            raise LabError(
                f"{len(failures)} of {len(groups)} places could not be solved; the first: {failures[0]}"
            )
    found = [curve for curve in map(_load, paths) if curve is not None]
    if len(found) < len(paths):
        raise LabError(f"solved touches in '{cache}' vanished while they were read: solve them again")
    return found


@contextmanager
def workers_of_ours(count: int) -> Iterator[ProcessPoolExecutor]:
    """Processes of one thread each, which do not run the caller's script again.

    A spawned process imports the main module first, so that a script without `if __name__ == "__main__"`
    would begin anew in each of them. Our workers need nothing of it: while they start, it is hidden.
    """
    main = sys.modules["__main__"]
    context = get_context("spawn")
    with _one_thread_each(), ProcessPoolExecutor(count, context, initializer=_follow_parent) as pool:
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield pool
        except BaseException:
            # what is left to do is for nothing: do not wait for it
            working = list((pool._processes or {}).values())
            pool.shutdown(wait=False, cancel_futures=True)
            for process in working:
                process.terminate()
            raise
        finally:
            sys.modules["__main__"] = main


def _follow_parent() -> None:
    """In a worker: Ctrl-C is the parent's business, which then ends this process; it ends with the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is None:
        return

    def wait() -> None:
        # a pool's worker holds both ends of its queue: from that it never learns that the parent was killed
        parent.join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Processes started inside compute on one thread; libraries read this once, when they are loaded."""
    names = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
