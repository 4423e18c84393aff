"""Young's modulus by finite elements (section 2.4, equations 7 to 13)."""
