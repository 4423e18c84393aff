"""Benchmarks: one module a subject, run by `palpate bench NAME`.

Each module has `SUMMARY`, `add_arguments(parser)` and `run(arguments) -> dict`; the dict is printed as
JSON on demand, the module prints its own table. Figures are ratios against a peer or limit measured in the
same run.
"""
