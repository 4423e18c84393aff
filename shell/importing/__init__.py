"""Other programs' files become recordings: readers make tables, a mapping says what their columns are."""
