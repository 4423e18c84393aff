"""What `palpate open` made of a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from palpate.mechanics.result import Result


@dataclass(frozen=True, eq=False, repr=False)
class Opened(Result):
    """kind: recording, curves, mesh or model. sources: names of the files. understood: what it was taken for,
    and as what. odds: of the least sure of it. notes: what was done to it, a line each. result: a
    Reconstruction, Material, Model, or the Checkup that found something grave. `plot`, `show`: the result's.
    """

    kind: str
    sources: tuple[str, ...]
    understood: Mapping[str, str]
    result: Any
    notes: tuple[str, ...] = ()
    odds: float = 1e6

    @property
    def good(self) -> bool:
        """Whether nothing grave was found and the answer predicts."""
        return bool(getattr(self.result, "predicts", True)) and not getattr(self.result, "grave", False)
