"""Options of the servo."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from palpate.devices.safety import SafetyOptions
from palpate.mechanics.errors import OptionError
from palpate.mechanics.options import check_ranges, loosened, option
from palpate.render.passivity import PassivityOptions
from palpate.render.support import SupportOptions


@dataclass(frozen=True)
class ServoOptions:
    """The loop's rate, what happens without a parent, and the tool's tips.

    tip_offsets_m: (m, 3), the tips' centres in the tool's frame (turned by the device's orientation).
    """

    rate_hz: float = option(1000.0, "ticks a second", unit="Hz", flag="--rate", low=10.0, high=1e4)
    on_orphan: str = option(
        "stop", "when the window dies: stop with zero force, or go on", choices=("stop", "continue")
    )
    coupling: bool = option(True, "limit the stiffness to what the device renders stably")
    read_ahead_s: float = option(250e-6, "how long before a tick the device is read", unit="s")
    silence_s: float = option(
        1.0,
        "longest time without a message from the window; then the force is 0",
        unit="s",
        low=0.1,
        high=60.0,
        looser="higher",
    )
    late_s: float = option(200e-6, "a tick that starts later than this counts as late", unit="s")
    priority: int = option(60, "real-time priority where permitted, 0 for none", high=98)
    tip_offsets_m: tuple[tuple[float, float, float], ...] = ((0.0, 0.0, 0.0),)
    support_plane: SupportOptions = field(default_factory=SupportOptions)
    safety: SafetyOptions = field(default_factory=SafetyOptions)
    passivity: PassivityOptions = field(default_factory=PassivityOptions, metadata={"flags": False})

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.on_orphan not in ("stop", "continue"):
            raise OptionError(f"on_orphan is '{self.on_orphan}'; allowed are stop, continue")
        if not 0.0 <= self.read_ahead_s < 1.0 / self.rate_hz:
            raise OptionError(f"read_ahead_s is {self.read_ahead_s}; allowed is 0 to less than a tick")
        offsets = np.asarray(self.tip_offsets_m, dtype=float)
        if offsets.ndim != 2 or offsets.shape[1] != 3 or not np.isfinite(offsets).all():
            raise OptionError("tip_offsets_m needs three finite numbers a tip")

    @property
    def period_ns(self) -> int:
        """One tick."""
        return round(1e9 / self.rate_hz)

    @property
    def loosened(self) -> tuple[str, ...]:
        """What protects less than by default, in plain words."""
        parts = (self, self.safety, self.passivity, self.support_plane)
        words = tuple(word for part in parts for word in loosened(part))
        if not self.coupling:
            words += ("protection loosened: --no-coupling",)
        if not self.passivity.passivity:
            words += ("protection loosened: the passivity controller is off",)
        if self.on_orphan != "stop":
            words += (f"protection loosened: --on-orphan is {self.on_orphan} (default stop)",)
        return words
