"""The servo collects no garbage: what makes a renderer there must leave none that only a collection frees."""

from __future__ import annotations

import gc

import render


def test_making_a_renderer_leaves_no_cycle(block_renderer):
    model = block_renderer.model
    render.create("fem", model)  # what is made once and kept
    gc.collect()
    gc.disable()
    try:
        again = render.create("fem", model)
        del again
        assert gc.collect() < 100
    finally:
        gc.enable()
