"""Reconstruction: a recording becomes a model, one module a step of the paper."""

import mechanics as mechanics  # it says where compiled kernels are kept, before the first is decorated
