"""What makes the fitted data that ships with the product, and what shows that a move changed nothing
(`goldens`): `python -m tools.NAME`."""
