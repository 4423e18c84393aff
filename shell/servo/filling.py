"""A table that is filled in beside the loop, in a process of its own: a coarse one first, by the mesh's own
elements where they do, then place after place, the nearest to the tip first, then what lies between them.

Run as `python -m palpate.servo.filling MODEL FOLDER` with pickled RenderOptions on its input, then a line
`x y z` (m) wherever the tip has come; it tells of itself in JSON lines. It ends with its input, and what it
solved until then is kept in the model's folder.
"""

from __future__ import annotations

import json
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from palpate.child import module_command
from palpate.mechanics.disk.scratch import memory_folder, remove_left, temporary_prefix
from palpate.mechanics.errors import PalpateError
from palpate.mechanics.progress import Progress, silent
from palpate.render.options import RenderOptions
from palpate.servo.source import FieldChange
from palpate.words import table_words

FIRST, FIELD, WHOLE = "first", "field", "whole"
_AT_ONCE, _GROWTH = 32, 1.3
"""Places solved together; by how much more must be solved before the loop is told again."""
_FEW = 3
"""Times the first places: an object of no more has them all solved at once."""
_NICE = 10
_AIM_S, _LOOK_S = 0.2, 0.05


class FillingTable:
    """The parent's side. model: a MODEL folder; options: of the renderer that is felt.

    solved: the share of places that are. error_n: N, that 95 % of the force at depth_m stay within, by what
    places say of one that is left out; NaN before the first table, 0 for the whole one. whole: whether all is
    there, and kept. failure: why it ended before, '' where it did not.
    """

    def __init__(self, model: Path, options: RenderOptions) -> None:
        self._model = model
        self._folder = Path(tempfile.mkdtemp(prefix=temporary_prefix("filling-"), dir=memory_folder()))
        self.solved, self.error_n, self.depth_m = 0.0, float("nan"), float("nan")
        self.first = self.whole = False
        self.failure = ""
        self._said: tuple[str, float] = ("starting", 0.0)
        self._news: FieldChange | None = None
        self._aimed_s = 0.0
        self._process = subprocess.Popen(
            module_command("palpate.servo.filling", str(model), str(self._folder)),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
        )
        self._send(pickle.dumps(options))
        self._listener = threading.Thread(target=self._listen, name="filling", daemon=True)
        self._listener.start()

    def wait(self, progress: Progress = silent) -> None:
        """Until there is a first table; raises PalpateError where none came."""
        while not (self.first or self.whole):
            if not self._listener.is_alive():
                why = self.failure or "its process ended"
                raise PalpateError(f"the object's compliance could not be solved: {why}")
            progress(*self._said)
            time.sleep(_LOOK_S)

    def aim(self, tip_m: np.ndarray) -> None:
        """Solve next what is nearest to a tip there, (3,) m."""
        now = time.perf_counter()
        if now - self._aimed_s > _AIM_S and np.isfinite(tip_m).all():
            self._aimed_s = now
            self._send(f"{tip_m[0]:.6g} {tip_m[1]:.6g} {tip_m[2]:.6g}\n".encode())

    def news(self) -> FieldChange | None:
        """The newest field that was not asked for yet; None where there is none."""
        newest, self._news = self._news, None
        return newest

    @property
    def state(self) -> dict[str, Any]:
        """For `--json` and a recording."""
        keys = {"solved_share": self.solved, "whole": self.whole}
        return keys if self.whole else {**keys, "error_n": self.error_n, "error_depth_m": self.depth_m}

    @property
    def words(self) -> str:
        """For a person; '' for the whole table."""
        if self.failure:
            return f"the table stays coarse: {self.failure}"
        return "" if self.whole else table_words(self.solved, self.error_n, self.depth_m)

    def close(self) -> None:
        """End the process; what it solved is kept."""
        if self._process.stdin is not None:
            try:
                self._process.stdin.close()
            except OSError:
                pass
        try:
            self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        remove_left(self._model, self._process.pid)
        self._listener.join(1.0)
        shutil.rmtree(self._folder, ignore_errors=True)

    def _send(self, data: bytes) -> None:
        try:
            if self._process.stdin is not None and not self._process.stdin.closed:
                self._process.stdin.write(data)
                self._process.stdin.flush()
        except OSError:
            pass  # it has ended: the listener says why

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            message = json.loads(line)
            self._said = message.get("said", self._said)
            self.failure = message.get("error", self.failure)
            self.solved = message.get("solved", self.solved)
            self.error_n = message.get("error_n", self.error_n)
            self.depth_m = message.get("depth_m", self.depth_m)
            if FIELD in message:
                self._news, missed = FieldChange(Path(message[FIELD])), self._news
                if missed is not None:
                    missed.path.unlink(missing_ok=True)
            self.first = self.first or FIRST in message
            self.whole = self.whole or WHOLE in message
        if not self.whole and not self.failure:
            self.failure = "its process ended"


class _Tip(threading.Thread):
    """Where the tip was last; ends the process with its input."""

    def __init__(self, lines: BinaryIO) -> None:
        super().__init__(daemon=True)
        self._lines = lines
        self.at: np.ndarray | None = None

    def run(self) -> None:
        for line in self._lines:
            self.at = np.array([float(word) for word in line.split()])
        os._exit(0)


def _fill(model_path: Path, folder: Path, options: RenderOptions, tip: _Tip, tell: Any) -> None:
    """Returns once the whole table is kept."""
    from palpate.mechanics.compliance.coarse_table import CoarseCompliance, first_places
    from palpate.mechanics.compliance.on_demand import OnDemandCompliance
    from palpate.mechanics.compliance.stored_compliance import (
        load_coarse,
        load_or_condense,
        load_or_solve,
        own_places,
    )
    from palpate.mechanics.model.files import read_model
    from palpate.render.fem.renderer import FemRenderer
    from palpate.render.force_error import coarse_error

    def said(stage: str, share: float) -> None:
        tell({"said": (stage, share)})

    said("factorising the object", 0.0)
    model = read_model(model_path)

    def first_of(places: OnDemandCompliance) -> None:
        said("first places", 0.0)
        places.solve(first_places(places.own_points))  # at once: each pass costs, however few they are

    def at(compliance: CoarseCompliance) -> dict[str, Any]:
        error_n, depth_m = coarse_error(model, compliance, options)
        return {"solved": compliance.solved_share, "error_n": error_n, "depth_m": depth_m}

    renderer: FemRenderer | None = None
    begun = load_coarse(model)
    own = None if isinstance(begun, CoarseCompliance) and not begun.rough else own_places(model)
    if own is not None:
        first_of(own)
        tell({"solved": 0.0, FIRST: True})  # a second before its error is known
        _behind_the_loop()
        tell({**at(CoarseCompliance(own)), "solved": 0.0})
    solved = load_or_solve(model)
    if not isinstance(solved, OnDemandCompliance):
        return
    if own is None and len(solved.own_points) <= _FEW * len(first_places(solved.own_points)):
        load_or_condense(model, said)
        return
    first_of(solved)

    def felt(compliance: CoarseCompliance) -> None:
        """Let the loop feel it."""
        nonlocal renderer
        renderer = renderer or FemRenderer(model, options, compliance=compliance)
        far, bracing = renderer.field_of(compliance)
        change = FieldChange.written(folder / f"field-{len(compliance.known)}.npz", far, bracing=bracing)
        tell({**at(compliance), FIELD: str(change.path)})

    coarse = CoarseCompliance(solved)
    if own is None:
        tell({**at(coarse), FIRST: True})
        _behind_the_loop()
    else:
        felt(coarse)
    told = len(coarse.known)
    while not solved.is_solved.all():
        missing = np.flatnonzero(~solved.is_solved)
        middle = solved.own_points.mean(axis=0) if tip.at is None else tip.at
        near = np.linalg.norm(solved.own_points[missing] - middle, axis=1)
        solved.solve(np.sort(missing[np.argsort(near, kind="stable")[:_AT_ONCE]]))
        done = int(solved.is_solved.sum())
        if done >= _GROWTH * told or done == len(solved.own):
            told = done
            felt(CoarseCompliance(solved))
        else:
            tell({"solved": done / len(solved.own)})
    load_or_condense(model)


def _behind_the_loop() -> None:
    """The loop comes first from now on."""
    if hasattr(os, "nice"):
        os.nice(_NICE)


def main(argv: list[str]) -> int:
    """0 once the whole table is kept, 2 after an error that was told."""
    line = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # libraries may print

    def tell(message: dict[str, Any]) -> None:
        try:
            line.write(json.dumps(message) + "\n")
        except OSError:
            pass  # the parent is gone; the end of the input tells

    options = pickle.load(sys.stdin.buffer)
    tip = _Tip(sys.stdin.buffer)
    tip.start()
    try:
        _fill(Path(argv[1]), Path(argv[2]), options, tip, tell)
        tell({"solved": 1.0, "error_n": 0.0, WHOLE: True})
    except PalpateError as error:
        tell({"error": str(error)})
        return 2
    except Exception as error:
        tell({"error": f"{type(error).__name__}: {error}", "trace": traceback.format_exc()})
        return 2
    return 0


if __name__ == "__main__":
    from palpate.servo.filling import main as _main  # what is pickled names this module, not __main__

    status = _main(sys.argv)
    sys.stderr.flush()
    os._exit(status)
