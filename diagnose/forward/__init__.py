"""The forward model: the presses as a diagnosis weighs them (`touches`), the force that a model predicts for
each (`prediction`, `kernel`), and for presses that were not made (`planned`)."""
