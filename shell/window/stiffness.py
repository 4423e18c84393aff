"""Local stiffness over a surface, computed beside the session's frames."""

from __future__ import annotations

import numpy as np

from palpate.render.base import Renderer
from palpate.render.surface.felt_surface import local_stiffness
from palpate.window.worker import Worker


class StiffnessMap:
    """The maps of the renderers that are drawn, new ones whenever those change."""

    def __init__(self, worker: Worker, tip_radius_m: float) -> None:
        self._worker = worker
        self._radius_m = tip_radius_m
        self._shown: tuple[Renderer, ...] = ()
        self._ready: tuple[tuple[Renderer, ...], list[np.ndarray]] | None = None
        self._depth_m = float("nan")

    def forget(self) -> None:
        """The maps are wanted anew."""
        self._shown, self._ready = (), None

    def of(self, renderers: tuple[Renderer, ...], depth_m: float) -> list[np.ndarray]:
        """(n,) N/m for each renderer, once, when they are ready; an empty list before and after.

        Secant stiffness: force over depth of a press of depth_m.
        """
        if depth_m != self._depth_m:
            self.forget()
            self._depth_m = depth_m
        if self._ready is not None:
            (shown, maps), self._ready = self._ready, None
            if _same(shown, renderers):
                self._shown = shown
                return maps
        if not _same(self._shown, renderers):

            def job() -> None:
                maps = [np.nan_to_num(local_stiffness(r, self._radius_m, depth_m)) for r in renderers]
                if depth_m == self._depth_m:
                    self._ready = (renderers, maps)

            self._worker.offer("pressing every place for its stiffness", job)
        return []


def common_limits(maps: list[np.ndarray]) -> tuple[float, float]:
    """One scale over all pictures, N/m: without the stiffest fifth of what can be pressed, which is the foot,
    where the support is near, and would leave one colour to all the rest."""
    pressed = [values[values > 0] for values in maps]
    shown = np.concatenate([*pressed, np.zeros(0 if any(map(len, pressed)) else 1)])
    low, high = np.percentile(shown, [2, 80])
    return float(low), float(high)


def _same(a: tuple[Renderer, ...], b: tuple[Renderer, ...]) -> bool:
    return len(a) == len(b) and all(x is y for x, y in zip(a, b, strict=True))
