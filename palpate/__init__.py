"""Palpate: touch a real thing, and feel its copy. One import is the whole program: `import palpate as pp`.

    recording = pp.read_recording("silicone-1-cylinder")   # an embedded name, or NAME.csv.gz
    made = pp.reconstruct(recording)                       # its model, and how it came about
    replayed = pp.replay(made, recording)                  # rendered against measured force

`dir(pp)` lists functions, what they return, errors; `help(pp.press)` tells every option with its unit and
default. Results print themselves, `.plot()` by matplotlib, `.show()` in 3D by PyVista. SI units; device
frame; forces on the tool. See docs/howto/python.md.
Nothing is loaded until it is used (PEP 562).
"""

import importlib
from typing import TYPE_CHECKING

from palpate.operations._list import calls as _calls

if TYPE_CHECKING:
    from diagnose.compare.before_after import Changes as Changes
    from diagnose.compare.comparison import Comparison as Comparison
    from diagnose.explore.explorer import Explorer as Explorer
    from diagnose.explore.segments import Instrument as Instrument
    from diagnose.explore.segments import Segment as Segment
    from diagnose.other_simulator.result import SimulatedGap as SimulatedGap
    from diagnose.specimen.result import Material as Material
    from diagnose.verdict.result import Diagnosis as Diagnosis
    from mechanics.errors import CacheError as CacheError
    from mechanics.errors import ContactError as ContactError
    from mechanics.errors import DeviceError as DeviceError
    from mechanics.errors import DiagnosisError as DiagnosisError
    from mechanics.errors import FileError as FileError
    from mechanics.errors import LoudAirError as LoudAirError
    from mechanics.errors import MeshError as MeshError
    from mechanics.errors import ModelError as ModelError
    from mechanics.errors import NoBaseError as NoBaseError
    from mechanics.errors import OptionError as OptionError
    from mechanics.errors import PalpateError as PalpateError
    from mechanics.errors import RecordingError as RecordingError
    from mechanics.errors import SceneError as SceneError
    from mechanics.errors import SurfaceError as SurfaceError
    from mechanics.model.model import Model as Model
    from mechanics.recording.calibration import Calibration as Calibration
    from mechanics.recording.recording import Recording as Recording
    from palpate.batching.summary import Batch as Batch
    from palpate.importing.imported import Imported as Imported
    from palpate.importing.opened import Opened as Opened
    from palpate.operations._declare import options as options
    from palpate.operations.batch import batch as batch
    from palpate.operations.calibrate import calibrate as calibrate
    from palpate.operations.check import check as check
    from palpate.operations.compare import changes as changes
    from palpate.operations.compare import compare as compare
    from palpate.operations.diagnose import diagnose as diagnose
    from palpate.operations.export import export as export
    from palpate.operations.import_ import import_table as import_table
    from palpate.operations.import_ import read_table as read_table
    from palpate.operations.load import load as load
    from palpate.operations.material import material as material
    from palpate.operations.model import model_of as model_of
    from palpate.operations.open_ import open as open
    from palpate.operations.press import press as press
    from palpate.operations.read_recording import read_recording as read_recording
    from palpate.operations.read_recording import recording as recording
    from palpate.operations.reconstruct import reconstruct as reconstruct
    from palpate.operations.renderer import renderer as renderer
    from palpate.operations.replay import replay as replay
    from palpate.operations.simulate import simulate as simulate
    from reconstruct.checks.checkup import Checkup as Checkup
    from reconstruct.pipeline import Reconstruction as Reconstruction
    from render.base import Renderer as Renderer
    from render.press import Curve as Curve
    from render.replay import ReplayResult as ReplayResult
    from scenes.laboratory.simulate import Simulation as Simulation

    __version__: str

_OTHERS = {
    "diagnose.explore.explorer": "Explorer",
    "diagnose.explore.segments": "Instrument Segment",
    "palpate.operations._declare": "options",
    "mechanics.recording.recording": "Recording",
    "palpate.importing.imported": "Imported",
    "palpate.importing.opened": "Opened",
    "mechanics.recording.calibration": "Calibration",
    "diagnose.compare.before_after": "Changes",
    "reconstruct.checks.checkup": "Checkup",
    "diagnose.specimen.result": "Material",
    "mechanics.model.model": "Model",
    "reconstruct.pipeline": "Reconstruction",
    "render.replay": "ReplayResult",
    "render.press": "Curve",
    "diagnose.compare.comparison": "Comparison",
    "diagnose.verdict.result": "Diagnosis",
    "diagnose.other_simulator.result": "SimulatedGap",
    "scenes.laboratory.simulate": "Simulation",
    "palpate.batching.summary": "Batch",
    "render.base": "Renderer",
    "mechanics.errors": (
        "PalpateError FileError RecordingError ContactError LoudAirError NoBaseError SurfaceError MeshError "
        "ModelError CacheError OptionError DeviceError SceneError DiagnosisError"
    ),
}
_HOME = _calls() | {name: module for module, names in _OTHERS.items() for name in names.split()}

__all__ = [*_HOME, "__version__"]


def __getattr__(name: str) -> object:
    if name == "__version__":
        value: object = importlib.import_module("palpate.version").__version__
    elif (home := (_HOME | _calls()).get(name)) is not None:
        importlib.import_module("palpate.show")  # results know how they look
        value = getattr(importlib.import_module(home), name)
    else:
        raise AttributeError(f"module 'palpate' has no attribute '{name}'; it has {', '.join(_HOME)}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
