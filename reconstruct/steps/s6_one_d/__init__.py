"""Kelvin-Voigt and Hunt-Crossley models of single presses (section 2.3, equations 1 to 6)."""
