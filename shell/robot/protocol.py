"""Lines of JSON between the explorer and a robot: a suggestion out, what was felt in.

Out, one line each: {"suggest": {...}, "state": {...}} after the greeting and after every segment. In:
{"segment": "trace" or "press", "t": [...], "position": [[x, y, z], ...], "force": [[x, y, z], ...],
"quaternion": [[w, x, y, z], ...] (where known)}, or {"end": true}. Device frame, SI units; force on the
tool. A line that cannot be used is answered with {"error": "..."} and nothing of it is kept.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from typing import Any

from palpate.diagnosis.explore.explorer import Explorer
from palpate.diagnosis.explore.segments import Segment
from palpate.mechanics.errors import RecordingError

MOST_CHARACTERS = 64_000_000
"""Of one line: a minute at 1 kHz takes some 8 million."""


def segment_of(line: str) -> Segment | None:
    """What a robot's line says; None: it wants to end. Raises RecordingError for anything else."""
    if len(line) > MOST_CHARACTERS:
        raise RecordingError(f"a line of {len(line)} characters; at most {MOST_CHARACTERS} are read")
    try:
        said = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise RecordingError(f"a line is no JSON ({error}): send one object a line") from None
    if not isinstance(said, dict):
        raise RecordingError(f"a line holds a {type(said).__name__}; send an object with 'segment'")
    if said.get("end") is True:
        return None
    missing = [name for name in ("segment", "t", "position", "force") if name not in said]
    if missing:
        raise RecordingError(f"a segment lacks {', '.join(missing)}: send segment, t, position and force")
    try:
        return Segment(said["segment"], said["t"], said["position"], said["force"], said.get("quaternion"))
    except (TypeError, ValueError) as error:
        raise RecordingError(f"a segment's samples are no numbers in rows: {error}") from None


def answer(explorer: Explorer) -> dict[str, Any]:
    """What is said to the robot now."""
    return {"suggest": explorer.suggest().table(), "state": explorer.state.table()}


def serve(
    explorer: Explorer,
    lines: Iterable[str],
    say: Callable[[str], None],
    kept: Callable[[Explorer], object],
) -> None:
    """Talk until the robot ends, its lines do, or there is nothing left to suggest.

    kept: called after every segment that was taken in, so that nothing felt is lost.
    """
    reply = answer(explorer)
    say(json.dumps(reply))
    for line in lines:
        if not line.strip():
            continue
        try:
            segment = segment_of(line)
            if segment is None:
                return
            explorer.add(segment)
        except RecordingError as error:
            say(json.dumps({"error": str(error)}))
            continue
        kept(explorer)
        reply = answer(explorer)
        say(json.dumps(reply))
        if reply["suggest"]["kind"] == "stop":
            return
