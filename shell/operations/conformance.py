"""Write the kit by which anyone checks a soft-contact simulator: six bodies, paths of a tip, the true force.

DIR gets bodies/ (.stl, .vtu, .npz), paths/NAME.csv (t,x,y,z; s, m), truth/NAME.csv (t,fx,fy,fz,bound; s, N
on the tip), examples/ of nine flaws, adapters/ for some simulators, README.md, and score.py FORCES_DIR,
which needs numpy alone and prints one number last: the share of samples within the bound, 0 to 1.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from palpate.operations._call import Call
from palpate.operations._declare import operation
from palpate.operations._shared import save_option

if TYPE_CHECKING:
    from palpate.scenes.conformance.kit import Made


@operation()
def conformance(
    save: Annotated[
        str | Path,
        save_option("folder of the kit", "DIR", "palpate.scenes.conformance.kit:KIT", needed=True),
    ],
    *,
    call: Call,
) -> Made:
    """Write the kit by which anyone checks a soft-contact simulator: bodies and paths (m, s), forces (N).

    Raises FileError where something else than a kit is there, or it cannot be written.
    """
    from palpate.scenes.conformance.kit import write_kit

    with call.progress("conformance") as show_progress:
        made = write_kit(save, show_progress)
    call.following = [
        f"next: read {Path(save) / 'README.md'}, then python {Path(save) / 'score.py'} FORCES_DIR"
    ]
    return made
