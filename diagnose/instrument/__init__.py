"""The instrument's own share of the gap, before any press is looked at: what free air, the rigid support and
a second tracing of the base show of it."""
