"""Rendering: a model and a tip become a force, behind one small interface."""
