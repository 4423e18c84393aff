"""What was understood of other programs' files: a recording, and how each column was taken."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.importing.convert import Understood
from palpate.importing.write_imported import PICTURE, picture, write_imported
from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.result import Result


@dataclass(frozen=True, eq=False, repr=False)
class Imported(Result):
    """What was understood of a table: `recording` goes wherever a recording goes.

    notes: what was done to it, one line each. thing: what was said of the object. sources: the files. `plot`:
    force (N) over time (s); `show`: the tip's path (m); `draw`: all columns as they were understood.
    """

    understood: Understood
    thing: Mapping[str, Any]
    sources: tuple[str, ...]

    @property
    def recording(self) -> Recording:
        """SI units, device frame, force on the tool."""
        return self.understood.recording

    def draw(self, path: Path | str) -> Path:
        """Write the picture of what was understood; returns its path. No other picture is replaced."""
        from matplotlib import pyplot as plt

        path = Path(path)
        figure = picture(self.understood)
        with atomic_file(path, PICTURE) as temporary:
            figure.savefig(temporary, dpi=110, metadata={"Title": PICTURE.holds.decode()})
        plt.close(figure)
        return path

    def save(self, path: Path | str) -> Path:
        """Write NAME.csv.gz (or .csv) and NAME.toml; returns the samples' path."""
        return write_imported(path, self.understood, self.thing, list(self.sources))
