"""Reconstruction: a recording becomes a model, one module a step of the paper."""

from palpate import (
    mechanics as mechanics,  # it says where compiled kernels are kept, before the first is decorated
)
