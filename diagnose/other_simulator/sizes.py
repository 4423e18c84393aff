"""Which of what is named changes the force most: each alone, on a simulation that is right otherwise.

In the simulation as it came each acts on what the others did to its force, and which comes first would depend
on the others: a mesh that is half too soft takes half of what a wrong tip adds.
"""

from __future__ import annotations

from collections.abc import Sequence

from palpate.diagnosis.other_simulator.against_law import Numerics
from palpate.diagnosis.other_simulator.parts import PARAMETER_OF, Weighing, law_at
from palpate.diagnosis.other_simulator.stated import Stated, StatedForward


def sizes_alone(
    forward: StatedForward,
    numerics: Numerics,
    wrong: Sequence[str],
    measured: Stated,
    weighing: Weighing,
) -> dict[str, float]:
    """{name: N rms over contact samples} of the named numerics and the wrong parameters, with everything else
    as the recording says. forward: of all presses of the simulation."""
    law = law_at(forward, measured, numerics)
    # what the samples themselves show is a share of the force that is there
    level = weighing.rms_n(law) / max(weighing.rms_n(numerics.with_numerics), 1e-12)
    sizes = {}
    for name in numerics.named:
        if name not in numerics.values:
            sizes[name] = level * weighing.rms_n(numerics.force[name])
            continue
        sizes[name] = weighing.rms_n(law_at(forward, measured, numerics, [name]) - law)
    for name in wrong:
        key = PARAMETER_OF[name]
        other = measured.but(key, getattr(forward.stated, key))
        sizes[name] = weighing.rms_n(law_at(forward, other, numerics) - law)
    return sizes
