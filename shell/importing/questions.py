"""What is open is asked once, in plain words, on a terminal; elsewhere the line that names the flag ends the
command."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable
from typing import Any, TypeVar

from palpate.importing.meaning import Unclear
from palpate.mechanics.key_values import pairs
from palpate.operations._declare import Call

T = TypeVar("T")


def with_answers(work: Callable[[Any, Call], T], asked: Any, call: Call) -> T:
    """Do the work; where it is Unclear and a command runs on a terminal, ask and do it again.

    Raises what the work raises.
    """
    while True:
        try:
            return work(asked, call)
        except Unclear as unclear:
            if call.out.destination == "-" or not (sys.stdin.isatty() and sys.stderr.isatty()):
                raise
            answer = _answer(unclear)
            if unclear.option == "units":
                kind, _, unit = answer.partition("=")
                answer = {**dict(pairs(call.given.get("units"), "--units", "position=mm")), kind: unit}
            asked = dataclasses.replace(asked, **{unclear.option: answer})
            call = dataclasses.replace(call, given={**call.given, unclear.option: answer})


def _answer(unclear: Unclear) -> Any:
    """What is typed, until it is allowed; a number where there are no choices."""
    allowed = f" ({' or '.join(unclear.choices)})" if unclear.choices else ""
    while True:
        print(f"{unclear.question}{allowed}? ", end="", file=sys.stderr, flush=True)
        text = sys.stdin.readline()
        if not text:
            raise unclear
        text = text.strip()
        if text in unclear.choices:
            return text
        if not unclear.choices:
            try:
                return float(text)
            except ValueError:
                continue
