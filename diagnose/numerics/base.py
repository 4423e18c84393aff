"""What a numerical effect is: an effect (mechanics.effects.base) with advice on how to mend it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from palpate.mechanics.effects.base import Effect, Keys
from palpate.mechanics.presses.table import Presses

LEAST_SHARE = 0.1
"""Of a press's greatest force, below which a sample says nothing of whether contact was kept."""


@dataclass(frozen=True)
class Signal:
    """A simulated force sample by sample: t (n,) s, force (n, 3) N on the tool, depth (n,) m of the tip below
    the surface, normal (n, 3) outward there; parts: the samples of each press. left (n,) bool: samples that
    say nothing of the law."""

    t: np.ndarray
    force: np.ndarray
    depth: np.ndarray
    normal: np.ndarray
    parts: tuple[slice, ...]
    left: np.ndarray

    @property
    def push(self) -> np.ndarray:
        """(n,) N along the normal: below 0 where the tip is pulled in."""
        return np.einsum("ni,ni->n", self.force, self.normal)


@dataclass(frozen=True)
class SampleEvidence:
    """What the samples themselves show: the signal without it, and the effect's keys; {} where it is not
    there."""

    signal: Signal
    keys: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class NumericalEffect(Effect):
    """A flaw of a simulator. advice: what mends it, in words that fit any simulator. how_much(keys): by what
    factor, in words that go on from them. opposite(keys): the whole advice where it errs the other way, else
    ''.

    built_in: of how a simulator makes contact, which no setting of it changes: two of its runs share it.
    see(signal): of what shows in the samples themselves and needs no law; it is taken off before any law is
    fitted. None: it is searched for, as physical effects are.
    """

    domain: str = "numerics"
    advice: str = ""
    how_much: Callable[[Keys], str] | None = None
    opposite: Callable[[Keys], str] | None = None
    built_in: bool = False
    see: Callable[[Signal], SampleEvidence] | None = None

    def advised(self, keys: Keys, own_words: str = "") -> str:
        """What mends a flaw of this size; own_words: of the simulator, in place of `advice`."""
        other = self.opposite(keys) if self.opposite else ""
        much = f"; {self.how_much(keys)}" if self.how_much else ""
        return other or (own_words or self.advice) + much


def signal_of(presses: Presses, force: np.ndarray) -> Signal:
    """The signal of a table of presses (mechanics.presses.table) with a simulated force (n, 3) N at its
    rows."""
    normal, none = presses.normal[presses.press], np.zeros(len(force), bool)
    return Signal(presses.t, force, presses.travel[:, 0], normal, tuple(presses.parts), none)
