"""Guided exploration: a running estimate, the touch that would tell the most, and when to stop."""
