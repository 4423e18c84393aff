"""Guided exploration: what is known so far, which touch to make next, when to stop."""
