"""The servo: the 1 kHz loop in its own process (docs/explanation/loop-and-safety.md)."""

from palpate.devices.safety import SafetyOptions
from palpate.render.passivity import PassivityOptions
from palpate.servo.client import Servo
from palpate.servo.headless import exploring_hand, run_headless
from palpate.servo.options import ServoOptions
from palpate.servo.recorder import Recorder
from palpate.servo.report import ServoReport, ServoSnapshot
from palpate.servo.source import ModelSource, RendererSource

__all__ = [
    "ModelSource",
    "PassivityOptions",
    "Recorder",
    "RendererSource",
    "SafetyOptions",
    "Servo",
    "ServoOptions",
    "ServoReport",
    "ServoSnapshot",
    "exploring_hand",
    "run_headless",
]
