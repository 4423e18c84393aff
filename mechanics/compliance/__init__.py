"""How an object gives at its places, for unit modulus: solved there, condensed, in uneven fields, kept."""
