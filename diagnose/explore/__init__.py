"""Guided exploration: what was felt (`segments`), what is known of shape and modulus (`estimate`), of causes
(`weighing`, `causes`), how far each goal is (`goals`, `state`), and what to touch next (`candidates`,
`suggestion`); `explorer` runs it."""
