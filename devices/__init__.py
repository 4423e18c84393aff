"""Devices: protocols, codecs, drivers, the simulated hand and the one safety filter."""
