"""A kit by which anyone checks a soft-contact simulator: bodies, paths of a tip, the force with its bound."""
