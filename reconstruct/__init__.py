"""Reconstruction: a recording becomes a model, one module a step of the paper."""
