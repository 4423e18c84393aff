"""Phase II: where each palpation begins, peaks and ends, and where the surface was met (section 2.1)."""
