"""The functions behind `import palpate as pp`, which the commands call too: one way to do a thing.

A recording may be given as what `read_recording` returned, a simulation, a file or an embedded name; a model
as what `load` or `reconstruct` returned, a MODEL folder or a scene. SI units; device frame; forces on the
tool. What a room needs is imported when its function is called.
"""

import palpate.show as _show  # noqa: F401  (results know how they look)
from palpate.api.judging import changes, compare, diagnose
from palpate.api.laboratory import batch, calibrate, material, simulate
from palpate.api.models import export, load, model_of, reconstruct
from palpate.api.reading import check, import_table, read_recording, read_table
from palpate.api.touching import press, renderer, replay

__all__ = [
    "batch",
    "calibrate",
    "changes",
    "check",
    "compare",
    "diagnose",
    "export",
    "import_table",
    "load",
    "material",
    "model_of",
    "press",
    "read_recording",
    "read_table",
    "reconstruct",
    "renderer",
    "replay",
    "simulate",
]
