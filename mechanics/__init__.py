"""Mechanics: pure arrays and the frozen types that every other package shares. Imports none of them."""

from palpate.mechanics.kernel_cache import choose_folder

choose_folder()  # before the first kernel of ours is decorated
