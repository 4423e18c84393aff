"""Curves of a machine: one specimen pressed in one place, or in many."""
