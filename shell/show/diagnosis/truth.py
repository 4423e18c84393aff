"""A verdict beside the truth that was sealed: right or wrong, the true cause's rank, its size as stated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.effects.base import Role
from palpate.mechanics.effects.registry import effect
from palpate.show.diagnosis.gaps import in_model
from palpate.show.diagnosis.parameters import short
from palpate.words import spaced, spoken


def judged(result: Diagnosis, truth: Mapping[str, Any]) -> tuple[str, tuple[str, ...]]:
    """'right', 'partly right' or 'wrong', and the effects named that are not true. truth: of `[truth]` of a
    recording. What the model has already is no answer, unless it is true of the recording."""
    true = set(truth["effects"])
    named = {name for name in result.effects if name in true or name not in in_model(result)}
    word = "right" if named == true else "partly right" if named & true else "wrong"
    return word, tuple(sorted(named - true))


def truth_lines(result: Diagnosis, truth: Mapping[str, Any]) -> list[str]:
    """The verdict against the truth, in words."""
    word, made_up = judged(result, truth)
    true = tuple(truth["effects"])
    said = [f"truth: {spoken(true) or 'nothing was left out'}, as sealed; the verdict is {word}"]
    # a law that holds for every body is no cause, unless it was sealed as one
    causes = [e for e in result.entries if e.name in true or effect(e.name).role is not Role.KNOWN]
    entries = sorted(causes, key=lambda e: (e.probability, e.gain), reverse=True)
    rank = {entry.name: k for k, entry in enumerate(entries, 1)}
    for name in true:
        if name not in rank:
            said.append(f"  {spaced(name)} was not tried")
            continue
        entry, real = entries[rank[name] - 1], truth["parameters"].get(name, {})
        both = {key: value for key, value in entry.parameters.items() if key in real}
        sizes = f": {short(both)}; true {short({key: real[key] for key in both})}" if both else ""
        said.append(f"  {spaced(name)} is number {rank[name]} of {len(rank)} by probability{sizes}")
    return said + ([f"  not true: {spoken(made_up)}"] if made_up else [])
