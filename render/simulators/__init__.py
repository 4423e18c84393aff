"""Other simulators behind the renderer's interface: one file each, loaded when it is named.

A MODEL and a path of the tip go in, force on the tool comes out, headless. Each states its units, what it
cannot say and its version, and has two settings: as its own documentation says, and as good as it gets.
"""
