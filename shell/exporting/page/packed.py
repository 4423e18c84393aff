"""How a page holds arrays: as low-rank modes where they are smooth, in few bits, one compressed block."""

from __future__ import annotations

import base64
import gzip
from dataclasses import dataclass
from typing import Any

import numpy as np

MOST_MODES = 40
FINEST = 3e-4
"""Step of a weight, of the size of what its table holds: a tenth of the modes' own error."""
_SIGNED, _UNSIGNED = 32767, 65535


@dataclass(frozen=True)
class Modes:
    """A table (v, c) as weights (v, r) @ basis (r, c)."""

    weights: np.ndarray
    basis: np.ndarray


def modes_of(table: np.ndarray, size: np.ndarray, error: float, most: int = MOST_MODES) -> Modes:
    """As few modes as leave errors of at most `error` of size (c,) in 999 of 1000 entries, at most `most`."""
    scaled = table / size
    _, vectors = np.linalg.eigh(scaled.T @ scaled)
    vectors = vectors[:, ::-1]
    for count in range(1, min(most, vectors.shape[1]) + 1):
        basis = vectors[:, :count]
        weights = scaled @ basis
        if np.quantile(np.abs(scaled - weights @ basis.T), 0.999) <= error:
            break
    return Modes(weights, basis.T * size)


class Block:
    """Arrays one after another in one compressed block; `index` says where each is and how it is scaled."""

    def __init__(self) -> None:
        self.index: dict[str, dict[str, Any]] = {}
        self._parts: list[bytes] = []
        self._length = 0

    def whole(self, name: str, values: np.ndarray) -> None:
        """Whole numbers from 0 on, as they are, in 16 or 32 bits."""
        kind = "u2" if values.size == 0 or values.max() <= _UNSIGNED else "u4"
        self._add(name, values, kind)

    def floats(self, name: str, values: np.ndarray) -> None:
        """32-bit floats."""
        self._add(name, values, "f4")

    def between(self, name: str, values: np.ndarray) -> None:
        """(n, c) in 16 bits, each column between its least and greatest: an error of 8e-6 of that range."""
        low = values.min(axis=0)
        step = np.maximum(values.max(axis=0) - low, 1e-300) / _UNSIGNED
        self._add(name, np.rint((values - low) / step), "u2", low=low.tolist(), step=step.tolist())

    def around(self, name: str, values: np.ndarray) -> None:
        """(n, c) in 16 bits with a sign, each column up to its greatest size."""
        self._signed(name, values, np.maximum(np.abs(values).max(axis=0), 1e-300) / _SIGNED)

    def modes(self, name: str, modes: Modes) -> None:
        """NAME_weights in 16 bits, none finer than FINEST: a weak mode has few digits, and compresses the
        better; and NAME_basis in floats."""
        step = np.maximum(np.abs(modes.weights).max(axis=0) / _SIGNED, FINEST)
        self._signed(f"{name}_weights", modes.weights, step)
        self.floats(f"{name}_basis", modes.basis)

    def _signed(self, name: str, values: np.ndarray, step: np.ndarray) -> None:
        self._add(name, np.rint(values / step), "i2", low=[0.0] * len(step), step=step.tolist())

    def _add(self, name: str, values: np.ndarray, kind: str, **scale: list[float]) -> None:
        # column by column: neighbours are alike there, which compresses better
        data = np.ascontiguousarray(np.asarray(values).T).astype(f"<{kind}").tobytes()
        data += bytes(-len(data) % 4)
        self.index[name] = {"at": self._length, "kind": kind, "shape": list(np.shape(values)), **scale}
        self._parts.append(data)
        self._length += len(data)

    def base64(self) -> str:
        """The block, compressed by gzip (the same bytes each time)."""
        return base64.b64encode(gzip.compress(b"".join(self._parts), 9, mtime=0)).decode()
