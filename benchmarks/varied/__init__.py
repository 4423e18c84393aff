"""Explorations as varied as the world: what is no part of the question is drawn widely, by seed.

Objects of many families at random sizes, and nuisances of hand, instrument and writing that leave the truth
as it is. The virtual laboratory answers for the forces.
"""
