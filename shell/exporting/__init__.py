"""A model for other programs: one file a format, each written from the same `Subject`."""
