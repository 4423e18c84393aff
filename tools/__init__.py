"""What makes the fitted data that ships with the product: one module a file, `python -m tools.NAME`."""
