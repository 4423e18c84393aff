"""The check-up of a recording as a result: what may be wrong with it, and what was measured on the way."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.result import Result
from palpate.reconstruction.checks.finding import Finding


@dataclass(frozen=True, eq=False, repr=False)
class Checkup(Result):
    """What may be wrong with a recording; the gravest first.

    findings: each with name, saw, sure, todo, grave, error (relative, of the modulus), stretch (s), channels.
    seen: what was measured on the way: words with the unit, value, what is usual (NaN where nothing is).
    full: whether the modulus was looked at too. `plot`: force over time, stretches shaded. `show`: the path.
    """

    recording: Recording
    findings: tuple[Finding, ...]
    seen: tuple[tuple[str, float, float], ...] = ()
    full: bool = False

    @property
    def grave(self) -> tuple[Finding, ...]:
        """Findings for which `reconstruct` refuses the recording."""
        return tuple(f for f in self.findings if f.grave)
