"""The instrument's own share, told by free air, the rigid support, a second tracing, a known object."""
