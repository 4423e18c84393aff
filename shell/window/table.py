"""The compliance of a session: as much of it as a first touch needs, and the rest while it is felt."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from palpate.mechanics.compliance.stored_compliance import fills, load_or_condense
from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress
from palpate.render.fem.fine_surface import keep_surface
from palpate.servo import Servo
from palpate.servo.filling import FillingTable
from palpate.servo.source import FieldChange
from palpate.window.window_renderers import DrawnRenderers
from palpate.window.worker import Worker


class SessionTable:
    """Of what a servo renders and a session draws. changed: called in the worker after what is drawn has.

    all_drawn: whether what is drawn knows all places and what lies between them.
    """

    def __init__(
        self, servo: Servo, drawn: DrawnRenderers, worker: Worker, changed: Callable[[], None]
    ) -> None:
        self._servo, self._drawn, self._worker, self._changed = servo, drawn, worker, changed
        self._filling: FillingTable | None = None
        self.all_drawn = True

    def begin(self, model: Model, progress: Progress) -> None:
        """What a first touch needs is kept in the model's folder then. Several tips move one another: they
        need the whole."""
        several = len(self._servo.options.tip_offsets_m) > 1
        if several or not fills(model):
            load_or_condense(model, progress)
            return
        self.all_drawn = False
        self._filling = FillingTable(self._servo.folder, self._drawn.options)
        keep_surface(model, self._drawn.options)  # meanwhile
        self._filling.wait(progress)

    def follow(self, tip_m: np.ndarray) -> None:
        """Tell where the tip is, (3,) m, and let what was solved be felt and drawn."""
        filling = self._filling
        if filling is None or self.all_drawn:
            return
        filling.aim(tip_m)
        if not self._worker.idle:
            return
        change = filling.news()
        if change is not None:
            self._worker.run("a finer table", lambda: self._refine(change))
        elif filling.whole:
            self._worker.run("the whole table", self._draw_whole)

    def _refine(self, change: FieldChange) -> None:
        self._servo.change(change)
        self._drawn.change(change)
        change.path.unlink(missing_ok=True)
        self._changed()

    def _draw_whole(self) -> None:
        """What is felt has all places already."""
        self.all_drawn = True
        self._drawn.make_anew(self._drawn.made, self._worker.tell)
        self._drawn.know_stiffness()
        self._changed()

    @property
    def words(self) -> str:
        """How many places are solved, and the error meanwhile; '' for the whole table."""
        return "" if self._filling is None else self._filling.words

    @property
    def state(self) -> dict[str, Any]:
        """The same as keys with units."""
        return {"solved_share": 1.0, "whole": True} if self._filling is None else self._filling.state

    def close(self) -> None:
        """No more is solved."""
        if self._filling is not None:
            self._filling.close()
