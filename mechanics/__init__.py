"""Mechanics: pure arrays and the frozen types that every other room shares. Imports nothing of ours."""
