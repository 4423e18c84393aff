"""What a servo session did: ticks, deadlines, forces, faults, energy; and the newest tick for a window."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.devices.safety import WORDS, reason_words
from palpate.mechanics.result import plain
from palpate.render.passivity import DISSIPATED, LEAST
from palpate.servo.histogram import Histogram
from palpate.servo.layout import (
    CONTACT_TICKS,
    HEAD_WIDTH,
    LATE,
    MISSED,
    ROW,
    ROW_WIDTH,
    TICKS,
    TIP_WIDTH,
    UNSETTLED,
    SharedArrays,
    read_copy,
)
from palpate.words import unsettled_words


@dataclass(frozen=True)
class ServoReport:
    """SI; the histograms' summaries in microseconds.

    late_ticks: started more than the options' `late_s` after their deadline; missed_ticks: never run;
    unsettled_ticks: the force did not settle, and the last one was held.
    energy_given_back_j: most that the hand ever got back net, energy_damped_j: what the controller took.
    reasons: ticks on which the safety filter gave each reason. words: what the system did not permit.
    """

    ticks: int
    seconds: float
    rate_hz: float
    missed_ticks: int
    late_ticks: int
    compute: Histogram = field(metadata={"json": "compute_us"})
    lateness: Histogram = field(metadata={"json": "lateness_us"})
    peak_rendered_n: float
    peak_force_n: float
    contact_share: float
    energy_given_back_j: float
    energy_damped_j: float
    reasons: dict[str, int] = field(default_factory=dict)
    words: tuple[str, ...] = ()
    cpu_s: float = float("nan")
    wall_s: float = float("nan")
    unsettled_ticks: int = 0

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        table: dict[str, Any] = plain(self)
        return table

    def __str__(self) -> str:
        return self.text()

    def _held_back(self) -> str:
        """Why less was sent than rendered: the two rules that acted most; '' where none did."""
        acted = sorted((n, word) for word, n in self.reasons.items())
        if not acted or self.peak_force_n >= _LESS * self.peak_rendered_n:
            return ""
        return f" (safety held the rest back: {', '.join(word for _, word in acted[:-3:-1])})"

    def text(self, *, to: str = "the device") -> str:
        """In lines. to: what a force was sent to, '' for what takes none."""
        c, late = self.compute.as_json(), self.lateness.as_json()
        lines = [
            f"{self.rate_hz:.0f} forces a second for {self.seconds:.1f} s: "
            f"{self.missed_ticks} skipped, {self.late_ticks} late",
            f"in contact {100 * self.contact_share:.0f} % of the time; greatest force "
            f"{self.peak_rendered_n:.2f} N rendered"
            + (f", {self.peak_force_n:.2f} N sent to {to}{self._held_back()}" if to else ", none sent")
            + f"; energy given to the hand at most {1000 * self.energy_given_back_j:.3f} mJ",
            f"one force is computed in {c['median']:.0f} µs (median), {c['max']:.0f} µs at most",
            f"it begins {late['median']:.0f} µs after its time (median), {late['max']:.0f} µs at most",
        ]
        if self.unsettled_ticks:
            lines.append(unsettled_words(self.unsettled_ticks, self.ticks))
        return "\n".join([*lines, *self.words])


_LESS = 0.9
"""Of the rendered force: what is sent below that was held back."""


def report(
    arrays: SharedArrays, period_ns: int, words: tuple[str, ...], cpu_s: float, wall_s: float
) -> ServoReport:
    """Read the counters."""
    counts = arrays.counts
    ticks, missed = int(counts[TICKS]), int(counts[MISSED])
    seconds = (ticks + missed) * period_ns * 1e-9
    return ServoReport(
        ticks=ticks,
        seconds=seconds,
        rate_hz=ticks / seconds if seconds else 0.0,
        missed_ticks=missed,
        late_ticks=int(counts[LATE]),
        compute=_histogram(arrays.compute_bins, arrays.compute_extremes),
        lateness=_histogram(arrays.lateness_bins, arrays.lateness_extremes),
        peak_rendered_n=float(arrays.peak[0]),
        peak_force_n=float(arrays.peak[1]),
        contact_share=int(counts[CONTACT_TICKS]) / ticks if ticks else 0.0,
        energy_given_back_j=-float(arrays.energies[LEAST]) + 0.0,
        energy_damped_j=float(arrays.energies[DISSIPATED]),
        reasons={
            word: int(n)
            for bit, word in WORDS.items()
            if (n := arrays.reason_counts[bit.bit_length() - 1]) > 0
        },
        words=words,
        cpu_s=cpu_s,
        wall_s=wall_s,
        unsettled_ticks=int(counts[UNSETTLED]),
    )


def _histogram(bins: np.ndarray, extremes: np.ndarray) -> Histogram:
    return Histogram(bins.copy(), int(extremes[1]), int(extremes[2]))


@dataclass(frozen=True)
class ServoSnapshot:
    """The newest tick, for a window. m tips; scene frame but for `command_n`.

    forces_n: (m, 3) rendered, on the tool; command_n: (3,) sent to the device. reason: '' or plain words.
    """

    tick: int
    time_s: float
    command_n: np.ndarray
    quaternion: np.ndarray
    buttons: int
    force_enabled: bool
    reason: str
    tips: np.ndarray
    forces_n: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    depths: np.ndarray
    touching: np.ndarray
    stiffness: np.ndarray


def snapshot(arrays: SharedArrays) -> ServoSnapshot | None:
    """A consistent copy; None before the first tick."""
    block = read_copy(arrays.snapshot_version, arrays.snapshot)
    if block is None or block[HEAD_WIDTH - 1] == 0:
        return None
    row = block[:ROW_WIDTH].view(ROW)[0]
    m = int(block[HEAD_WIDTH - 1])
    tips = block[HEAD_WIDTH : HEAD_WIDTH + m * TIP_WIDTH].reshape(m, TIP_WIDTH)
    return ServoSnapshot(
        tick=int(row["tick"]),
        time_s=float(row["time_s"]),
        command_n=row["command"].copy(),
        quaternion=row["quaternion"].copy(),
        buttons=int(row["buttons"]),
        force_enabled=bool(row["enabled"]),
        reason=reason_words(int(row["reasons"])),
        tips=tips[:, :3].copy(),
        forces_n=tips[:, 3:6].copy(),
        points=tips[:, 6:9].copy(),
        normals=tips[:, 9:12].copy(),
        depths=tips[:, 12].copy(),
        touching=tips[:, 13] != 0,
        stiffness=tips[:, 14].copy(),
    )


def ring_rows(arrays: SharedArrays, since: int) -> tuple[np.ndarray, int]:
    """Rows written after the first `since` ones that the ring still holds, and how many there are by now."""
    rows = len(arrays.ring)
    head = int(arrays.ring_head[0])
    # a margin, since the writer goes on while these rows are copied
    first = max(since, head - rows + rows // 8)
    picked = arrays.ring[np.arange(first, head) % rows].copy()
    return picked.view(ROW).reshape(-1), head
