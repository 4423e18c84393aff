"""A page that can be pressed in any browser: tables of the renderer's own presses, and what interpolates
them."""
