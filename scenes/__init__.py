"""Scenes: what can be touched: phantoms, embedded recordings, scene files, the virtual laboratory."""

from palpate import (
    mechanics as mechanics,  # it says where compiled kernels are kept, before the first is decorated
)
