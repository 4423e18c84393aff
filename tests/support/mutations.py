"""Ways to damage a file: bits, lines, numbers, encodings, columns of samples. Each is a function
(bytes, random) -> bytes."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np

Mutation = Callable[[bytes, np.random.Generator], bytes]
NUMBER = re.compile(rb"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
EXTREMES = (
    b"nan", b"NaN", b"inf", b"-inf", b"Infinity", b"1e308", b"-1e308", b"0", b"-1", b"1e-308", b"1e200",
    b"9" * 400, b"0x10", b"", b" ", b"true", b'"x"', b"[1, 2]", b"{}", "\u65e5\u672c".encode(),
)  # fmt: skip


def flip_bits(data: bytes, random: np.random.Generator) -> bytes:
    """One to eight bits turned over."""
    changed = bytearray(data)
    for at in random.integers(0, len(changed), random.integers(1, 9)):
        changed[at] ^= 1 << int(random.integers(8))
    return bytes(changed)


def cut(data: bytes, random: np.random.Generator) -> bytes:
    """The end is missing."""
    return data[: int(random.integers(0, len(data)))]


def hole(data: bytes, random: np.random.Generator) -> bytes:
    """A stretch is missing."""
    a, b = sorted(random.integers(0, len(data), 2))
    return data[:a] + data[min(b, a + 5000) :]


def repeat(data: bytes, random: np.random.Generator) -> bytes:
    """A stretch stands twice."""
    a, b = sorted(random.integers(0, len(data), 2))
    return data[:b] + data[a:b][:100_000] + data[b:]


def noise(data: bytes, random: np.random.Generator) -> bytes:
    """Random bytes in between."""
    at = int(random.integers(0, len(data)))
    return data[:at] + random.bytes(int(random.integers(1, 60))) + data[at:]


def zeros(data: bytes, random: np.random.Generator) -> bytes:
    """A stretch of zeros, as a disk leaves that lost power."""
    a, b = sorted(random.integers(0, len(data) + 1, 2))
    return data[:a] + bytes(int(b - a)) + data[b:]


def number(data: bytes, random: np.random.Generator) -> bytes:
    """A number becomes something that no reading is."""
    found = list(NUMBER.finditer(data[:200_000]))
    if not found:
        return noise(data, random)
    match = found[int(random.integers(len(found)))]
    return data[: match.start()] + EXTREMES[int(random.integers(len(EXTREMES)))] + data[match.end() :]


def scaled(data: bytes, random: np.random.Generator) -> bytes:
    """A number becomes 1e3 or 1e-3 times itself, or another sign."""
    found = list(NUMBER.finditer(data[:200_000]))
    if not found:
        return noise(data, random)
    match = found[int(random.integers(len(found)))]
    new = b"%.9g" % (float(match.group()) * float(random.choice([1e3, 1e-3, -1.0])))
    return data[: match.start()] + new + data[match.end() :]


def line(data: bytes, random: np.random.Generator) -> bytes:
    """A line is lost, doubled, or swapped with another."""
    lines = data.split(b"\n")
    i, j = random.integers(0, len(lines), 2)
    kind = int(random.integers(3))
    if kind == 0:
        del lines[i]
    elif kind == 1:
        lines.insert(j, lines[i])
    else:
        lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


def encoding(data: bytes, random: np.random.Generator) -> bytes:
    """UTF-16, a byte order mark, other line ends, semicolons and decimal commas."""
    kind = int(random.integers(4))
    if kind == 0:
        return data.decode("latin-1").encode("utf-16")
    if kind == 1:
        return b"\xef\xbb\xbf" + data
    if kind == 2:
        return data.replace(b"\n", b"\r")
    return data.replace(b",", b";").replace(b".", b",")


def column(data: bytes, random: np.random.Generator) -> bytes:
    """A column of a CSV scaled by anything, shifted, held, swapped with another or played backwards."""
    head, _, body = data.partition(b"\n")
    try:
        table = np.array([row.split(b",") for row in body.split()], dtype=float)
    except ValueError:
        return noise(data, random)
    if table.ndim != 2 or table.shape[1] < 2:
        return noise(data, random)
    i, j = random.choice(table.shape[1], 2, replace=False)
    kind = int(random.integers(5))
    if kind == 0:
        table[:, i] *= float(random.choice([-1, 1])) * 10.0 ** random.uniform(-6, 6)
    elif kind == 1:
        table[:, i] += 10.0 ** random.uniform(-3, 3)
    elif kind == 2:
        table[int(random.integers(len(table))) :, i] = table[0, i]
    elif kind == 3:
        table[:, [i, j]] = table[:, [j, i]]
    else:
        table[:, i] = table[::-1, i]
    rows = (",".join(f"{v:.9g}" for v in row) for row in table)
    return head + b"\n" + "\n".join(rows).encode() + b"\n"


MUTATIONS: tuple[Mutation, ...] = (
    flip_bits, cut, hole, repeat, noise, zeros, number, number, scaled, line, encoding,
)  # fmt: skip
"""Of any file."""
OF_SAMPLES: tuple[Mutation, ...] = (*MUTATIONS, column, column, column)
"""Of a recording's CSV."""
