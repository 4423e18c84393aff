"""Reports: one self-contained HTML page of words, tables and pictures."""
