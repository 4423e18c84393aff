"""The verdict: what is named, what cannot be told apart, how far the gap shrinks, what to touch next."""
