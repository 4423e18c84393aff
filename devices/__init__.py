"""Devices: protocols, codecs, drivers, the simulated hand and the one safety filter."""

from palpate import (
    mechanics as mechanics,  # it says where compiled kernels are kept, before the first is decorated
)
