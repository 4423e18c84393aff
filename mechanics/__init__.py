"""Mechanics: pure arrays and the frozen types that every other room shares. Imports nothing of ours."""

from mechanics.kernel_cache import choose_folder

choose_folder()  # before the first kernel of ours is decorated
