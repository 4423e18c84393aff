"""The touch window: what a session shows, how a mouse becomes a tip. The servo runs in its own process."""
