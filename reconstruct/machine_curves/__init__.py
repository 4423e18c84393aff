"""Measured data of other instruments: readers that turn a maker's file into SI arrays, and what each can
tell."""
