"""Fixtures that every room's tests share."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import mechanics  # noqa: F401  where compiled kernels are kept, before a test decorates one

REPOSITORY = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def shared_recordings() -> Path:
    """The folder of labelled recordings beside the checkout; tests that need it are skipped without it."""
    root = Path(os.environ.get("PALPATE_SHARED", REPOSITORY.parent / "shared"))
    folder = root / "recordings"
    if not folder.is_dir():
        pytest.skip("the labelled recordings are not beside the checkout (set PALPATE_SHARED)")
    return folder
