"""Bytes to values and back, without I/O: each codec can be tested from documented bytes alone."""
