"""Diagnosis: where a simulated touch leaves the measured one, which effect causes it, how far it shrinks."""
