"""What the program does, one file an operation: as a command, and as a Python call of the same words."""
