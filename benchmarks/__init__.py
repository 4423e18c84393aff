"""Benchmarks: one module a subject, run by `palpate bench NAME` from inside the clone.

Each has `add_arguments(parser)` and `run(arguments) -> dict`; the dict is printed as JSON with `--json`, and
its "figures", a list of `evidence.Figure`, are kept by `--evidence`. They lie beside the product, not in the
wheel: what shows speed, scale, or truth beside a peer. What must hold is a test (tests/), what fits data a
tool (tools/).
"""
