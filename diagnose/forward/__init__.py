"""What a tip feels: the presses as a diagnosis weighs them, and the force that a model predicts for each."""
