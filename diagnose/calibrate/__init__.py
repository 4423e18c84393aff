"""Calibration of an instrument by presses on something known: an object of known modulus, a rigid plate."""
