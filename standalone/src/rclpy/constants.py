"""Numbers shared by times and durations."""

S_TO_NS = 1000 * 1000 * 1000
"""Nanoseconds in one second."""
