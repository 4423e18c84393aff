"""The virtual laboratory: finite-strain solids, a rigid tip and a person's hand write honest recordings.

Its physics is its own: nothing here is shared with the models and diagnoses that it judges. Inside, lengths
are millimetres and Young's modulus of the matrix is 1, so that forces come in units of E mm^2 and scale with
E.
"""
