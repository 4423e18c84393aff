"""A reconstructed model: what it is made of, the laws that it carries, its folder."""
