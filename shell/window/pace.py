"""Which parts of the window are drawn at the next picture: where drawing is slow, what is felt comes first.

A part that is not drawn keeps what it showed, and costs nothing.
"""

from __future__ import annotations

SLOW_S, QUICK_S = 1 / 30, 1 / 50
"""Between pictures: above the first the other parts come less often, below the second as often again."""
WORDS_S = 0.1
_MEMORY = 0.2
_PAUSE_S = 0.5


class Pace:
    """Learns how long a picture takes from how often it is asked."""

    def __init__(self) -> None:
        self._last_s: float | None = None
        self._usual_s = 0.0
        self._slow = False
        self._words_s = float("-inf")
        self._pictures = 0
        self._all = True

    def next(self, now_s: float) -> tuple[bool, bool]:
        """At a picture that begins now: whether the second picture is drawn, and whether words and plots."""
        if self._last_s is not None:
            took = min(now_s - self._last_s, _PAUSE_S)
            self._usual_s += _MEMORY * (took - self._usual_s)
        self._last_s = now_s
        self._slow = self._usual_s > (QUICK_S if self._slow else SLOW_S)
        self._pictures += 1
        everything, self._all = self._all or not self._slow, False
        words = everything or now_s - self._words_s >= WORDS_S
        if words:
            self._words_s = now_s
        return everything or self._pictures % 2 == 0, words

    def forget(self) -> None:
        """All is drawn at the next picture, whatever it costs."""
        self._all = True
