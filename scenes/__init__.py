"""Scenes: what can be touched: phantoms, embedded recordings, scene files, the virtual laboratory."""
