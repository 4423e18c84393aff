"""Files: the one boundary to the disk, arrays kept there, what a TOML may hold, other programs' formats."""
