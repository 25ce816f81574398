"""Physical constants."""

GRAVITY = 9.81
"""Acceleration due to gravity, m s-2."""
