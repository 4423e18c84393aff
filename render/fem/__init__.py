"""The finite-element renderer: model and compliance made ready, and its step in compiled kernels."""
