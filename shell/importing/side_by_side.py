"""Several tests in one table: Force, Distance, Time, Force, Distance, Time."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable

import numpy as np

from palpate.importing.mapping import named_first
from palpate.importing.tables import Table, without_unit

_NUMBERED = re.compile(r"\s*#\d+$")
"""What a reader puts behind a name that was there before."""


def side_by_side(table: Table) -> list[Table]:
    """A table a test, named by the file's name and its number, where travel and load stand there as often;
    what stands there once is each test's. Else the table itself."""
    tests = _tests(table, lambda name: _NUMBERED.sub("", name)) or _tests(table, _last_word)
    if len(tests) < 2:
        return [table]
    found = []
    for k, columns in enumerate(tests):
        values = np.column_stack(list(columns.values()))
        there = np.isfinite(values).all(axis=1)  # a shorter test ends before the others
        end = int(np.flatnonzero(there)[-1]) + 1 if there.any() else 0
        found.append(Table(f"{table.name}, test {k + 1}", {n: v[:end] for n, v in columns.items()}))
    return found


def _tests(table: Table, bare: Callable[[str], str]) -> list[dict[str, np.ndarray]]:
    """Each test's columns by their names without what tells tests apart; empty where there are not
    several."""
    names = list(table.columns)
    plain = {name: bare(name) for name in names}
    often = Counter(plain.values())
    count = max(often.values())
    if count < 2 or set(often.values()) - {1, count}:
        return []
    tests: list[dict[str, np.ndarray]] = [{} for _ in range(count)]
    seen: Counter[str] = Counter()
    for name in names:
        own = plain[name]
        for k in [seen[own]] if often[own] == count else range(count):
            tests[k][own] = table.columns[name]
        seen[own] += 1
    one = [Table(table.name, tests[0])]
    both = [named_first(one, what) for what in ("travel", "load")]
    return tests if all(found and often[found[1]] == count for found in both) else []


def _last_word(name: str) -> str:
    """'Test 2 Force (g)' is 'Force (g)'."""
    words = without_unit(_NUMBERED.sub("", name)).split()
    unit = name[len(without_unit(name)) :]
    return f"{words[-1] if words else name} {unit.strip()}".strip()
