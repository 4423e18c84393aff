"""The servo process's entry: `python -m palpate.servo BLOCK PARENT STAGE...` (palpate.servo.started)."""

import os
import sys

from palpate.servo.process import main

status = main(sys.argv)
# a daemon thread may hang in a driver: everything that matters is closed by now
sys.stderr.flush()
os._exit(status)
