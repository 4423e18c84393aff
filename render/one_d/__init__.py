"""The 1D renderers of Goksel et al.: laws of single presses spread over the surface, and their step."""
