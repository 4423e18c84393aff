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
    from palpate.batching.summary import Batch as Batch
    from palpate.diagnosis.compare.before_after import Changes as Changes
    from palpate.diagnosis.compare.comparison import Comparison as Comparison
    from palpate.diagnosis.explore.explorer import Explorer as Explorer
    from palpate.diagnosis.explore.segments import Instrument as Instrument
    from palpate.diagnosis.explore.segments import Segment as Segment
    from palpate.diagnosis.other_simulator.result import SimulatedGap as SimulatedGap
    from palpate.diagnosis.other_simulator.tuned import Tuned as Tuned
    from palpate.diagnosis.specimen.result import Material as Material
    from palpate.diagnosis.verdict.result import Diagnosis as Diagnosis
    from palpate.importing.imported import Imported as Imported
    from palpate.importing.kinds import Opened as Opened
    from palpate.mechanics.errors import CacheError as CacheError
    from palpate.mechanics.errors import ContactError as ContactError
    from palpate.mechanics.errors import DeviceError as DeviceError
    from palpate.mechanics.errors import DiagnosisError as DiagnosisError
    from palpate.mechanics.errors import FewPressesError as FewPressesError
    from palpate.mechanics.errors import FileError as FileError
    from palpate.mechanics.errors import LoudAirError as LoudAirError
    from palpate.mechanics.errors import MeshError as MeshError
    from palpate.mechanics.errors import ModelError as ModelError
    from palpate.mechanics.errors import NoBaseError as NoBaseError
    from palpate.mechanics.errors import NotClosedError as NotClosedError
    from palpate.mechanics.errors import OptionError as OptionError
    from palpate.mechanics.errors import PalpateError as PalpateError
    from palpate.mechanics.errors import RecordingError as RecordingError
    from palpate.mechanics.errors import SceneError as SceneError
    from palpate.mechanics.errors import SurfaceError as SurfaceError
    from palpate.mechanics.model.model import Model as Model
    from palpate.mechanics.recording.calibration import Calibration as Calibration
    from palpate.mechanics.recording.recording import Recording as Recording
    from palpate.operations._declare import options as options
    from palpate.operations.batch import batch as batch
    from palpate.operations.calibrate import calibrate as calibrate
    from palpate.operations.check import check as check
    from palpate.operations.compare import changes as changes
    from palpate.operations.compare import compare as compare
    from palpate.operations.conformance import conformance as conformance
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
    from palpate.operations.touch import touch as touch
    from palpate.operations.tune import tune as tune
    from palpate.reconstruction.checks.finding import Checkup as Checkup
    from palpate.reconstruction.pipeline import Reconstruction as Reconstruction
    from palpate.render.base import Renderer as Renderer
    from palpate.render.press import Curve as Curve
    from palpate.render.replay import ReplayResult as ReplayResult
    from palpate.scenes.laboratory.simulate import Simulation as Simulation

    __version__: str

_OTHERS = {
    "palpate.diagnosis.explore.explorer": "Explorer",
    "palpate.diagnosis.explore.segments": "Instrument Segment",
    "palpate.operations._declare": "options",
    "palpate.mechanics.recording.recording": "Recording",
    "palpate.importing.imported": "Imported",
    "palpate.importing.kinds": "Opened",
    "palpate.mechanics.recording.calibration": "Calibration",
    "palpate.diagnosis.compare.before_after": "Changes",
    "palpate.reconstruction.checks.finding": "Checkup",
    "palpate.diagnosis.specimen.result": "Material",
    "palpate.mechanics.model.model": "Model",
    "palpate.reconstruction.pipeline": "Reconstruction",
    "palpate.render.replay": "ReplayResult",
    "palpate.render.press": "Curve",
    "palpate.diagnosis.compare.comparison": "Comparison",
    "palpate.diagnosis.verdict.result": "Diagnosis",
    "palpate.diagnosis.other_simulator.result": "SimulatedGap",
    "palpate.diagnosis.other_simulator.tuned": "Tuned",
    "palpate.scenes.laboratory.simulate": "Simulation",
    "palpate.batching.summary": "Batch",
    "palpate.render.base": "Renderer",
    "palpate.mechanics.errors": (
        "PalpateError FileError RecordingError ContactError FewPressesError LoudAirError NoBaseError "
        "SurfaceError NotClosedError MeshError ModelError CacheError OptionError DeviceError SceneError "
        "DiagnosisError"
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
