"""One module a sub-command: `SUMMARY`, `add_arguments(parser)` and `run(arguments) -> int`."""
