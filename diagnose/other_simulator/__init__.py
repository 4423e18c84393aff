"""The gap of another simulator: its forces on the recorded path (`forces`), what it was given
(`declared_parameters`), what its numerics add (`against_law`), and the parts of the gap (`gap_decomposition`,
`result`)."""
