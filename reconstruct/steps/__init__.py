"""The paper's section 2, a folder a step, in its order."""
