"""What was understood of other programs' files: a recording, and how each column was taken.

An imported recording on disk, and a picture of what was understood.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.importing.convert import Understood
from palpate.mechanics.disk.toml_text import dump_toml
from palpate.mechanics.disk.writing import Kind, atomic_file
from palpate.mechanics.recording.files import DESCRIPTION, samples_path
from palpate.mechanics.recording.recording import Recording, named_beside, write_samples
from palpate.mechanics.result import Result
from palpate.show.page import subplots

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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


PICTURE = Kind(
    "a picture of palpate import", (b"\x89PNG", b"<?xml", b"%PDF"), holds=b"Read by palpate import",
    likely_bytes=1 << 22,
)  # fmt: skip
"""Other pictures, which may lie beside what is imported, are left alone."""


def write_imported(
    path: Path | str, understood: Understood, thing: Mapping[str, Any], sources: list[str]
) -> Path:
    """Write NAME.csv.gz (or .csv) with nine digits, whatever the scale, and NAME.toml, which says where it
    came from; returns the samples' path."""
    path = samples_path(path)
    recording = understood.recording
    write_samples(path, recording, ["%.9g"] * 11)
    about: dict[str, Any] = {"sample_rate_hz": recording.sample_rate_hz, "force_on": "tool"}
    if understood.quasi_static:
        about["quasi_static"] = True
    if understood.read_hz is not None:
        about["read_rate_hz"] = understood.read_hz
    table = {
        "recording": about,
        "tool": {"tip_radius_m": recording.tip_radius_m, **recording.description["tool"]},
        "object": named_beside(path, {**thing, "name": recording.object_name}),
        "import": {
            "files": sources,
            "columns": {role: str(c).partition(" = ")[2] for role, c in understood.columns.items()},
            "notes": list(understood.notes),
        },
    }
    table["import"] |= recording.description["import"]
    if recording.force_noise_std_n is not None:
        table["sensor"] = {"force_noise_std_n": recording.force_noise_std_n}
    stem = path.name.removesuffix(".gz").removesuffix(".csv")
    with atomic_file(path.with_name(stem + ".toml"), DESCRIPTION) as temporary:
        temporary.write_text(dump_toml(table), encoding="utf-8")
    return path


def picture(understood: Understood) -> Figure:
    """Position and force over time, the path from the side coloured by force, and what each column was
    taken for."""

    recording = understood.recording
    size = np.linalg.norm(recording.force_on_tool, axis=1)
    figure, axes = subplots(2, 2, figsize=(12, 6.4))
    step = max(1, len(recording.t) // 20000)
    t = recording.t[::step]
    label = "row" if understood.quasi_static else "time [s]"
    length, n_unit = _scale(np.ptp(recording.position, axis=0).max(), "m"), _scale(size.max(), "N")
    style = {"marker": ".", "ls": "none"} if understood.quasi_static else {"lw": 0.8}
    for k, axis in enumerate("xyz"):
        axes[0, 0].plot(t, recording.position[::step, k] * length[0], label=axis, **style)
        axes[1, 0].plot(t, recording.force_on_tool[::step, k] * n_unit[0], label=f"f{axis}", **style)
    axes[0, 0].set(xlabel=label, ylabel=f"tip's centre [{length[1]}]")
    axes[1, 0].set(xlabel=label, ylabel=f"force on the tool [{n_unit[1]}]")
    for ax in axes[:, 0]:
        ax.legend(frameon=False, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    across = int(np.argmax(np.ptp(recording.position[:, :2], axis=0)))
    seen = axes[0, 1].scatter(
        recording.position[::step, across] * length[0], recording.position[::step, 2] * length[0],
        c=size[::step] * n_unit[0], s=4, cmap="viridis",
    )  # fmt: skip
    axes[0, 1].set(xlabel=f"{'xy'[across]} [{length[1]}]", ylabel=f"z [{length[1]}]")
    figure.colorbar(seen, ax=axes[0, 1], label=f"force [{n_unit[1]}]")
    axes[1, 1].set_axis_off()
    words = [*map(str, understood.columns.values()), "", *understood.notes]
    text = "\n".join(line if len(line) < 92 else line[:89] + "..." for line in words)
    axes[1, 1].text(0, 1, text, va="top", family="monospace", fontsize=8)
    return figure


def _scale(value: float, unit: str) -> tuple[float, str]:
    """Factor and unit in which a value is between 1 and 1000."""
    for factor, letter in ((1.0, ""), (1e3, "m"), (1e6, "u"), (1e9, "n")):
        if value * factor >= 1:
            return factor, letter + unit
    return 1e9, "n" + unit
