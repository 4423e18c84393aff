"""What a device logged: its samples, their stretches, and what the instrument did to them."""
