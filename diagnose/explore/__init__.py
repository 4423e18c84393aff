"""Guided exploration: what was felt (`segments`), what is known of shape and modulus (`estimate`), of causes
(`forms`, `weighing`, `causes`), how far each goal is (`state`), and what to touch next (`candidates`,
`separating`, `suggestion`); `explorer` runs it."""
