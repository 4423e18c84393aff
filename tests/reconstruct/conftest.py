"""Fixtures of the reconstruction's tests."""

from __future__ import annotations

import numpy as np
import pytest

from mechanics.recording.recording import Recording

from .exploration_of_cylinder import explore_cylinder


@pytest.fixture(scope="session")
def cylinder() -> tuple[Recording, np.ndarray]:
    """A simulated exploration of a cylinder in a tilted, shifted frame, and the times of first touch."""
    return explore_cylinder()
