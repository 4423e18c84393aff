"""What every room of the door shares: what may be given, and where progress goes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from mechanics.progress import Progress, silent

if TYPE_CHECKING:
    import mechanics.model
    import mechanics.recording
    from reconstruct.pipeline import Reconstruction
    from scenes.laboratory.simulate import Simulation
    from scenes.scene import Scene

    RecordingLike = str | Path | mechanics.recording.Recording | Simulation
    ModelLike = str | Path | mechanics.model.Model | Reconstruction | Scene


@contextmanager
def told(label: str, progress: bool | Progress) -> Iterator[Progress]:
    """Where progress goes: to a callable, to a bar on a terminal, or nowhere."""
    if callable(progress):
        yield progress
    elif progress:
        from palpate.arguments import progress_bar

        with progress_bar(label) as bar:
            yield bar
    else:
        yield silent
