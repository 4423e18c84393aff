"""The surface through base and first touches (section 2.2)."""
