"""Files that hold tables of numbers: one file a format, and `registry` with a line for each."""
