"""Fixtures of the reconstruction's tests."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from exploration_of_cylinder import explore_cylinder

from mechanics.recording import Recording


@pytest.fixture(scope="session")
def cylinder() -> tuple[Recording, np.ndarray]:
    """A simulated exploration of a cylinder in a tilted, shifted frame, and the times of first touch."""
    return explore_cylinder()
