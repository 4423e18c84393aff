"""The gap of another simulator: its forces on the recorded path (`forces`), what it was given (`stated`),
what its numerics add (`against_law`), and the parts that the gap is made of (`parts`, `result`)."""
