"""What a simulator adds of its own to the force of an ideal elastic object: one file an effect, found against
our own law at that simulator's stated parameters, where no measurement noise stands in the way."""
