"""Exact solutions and the scenes that are compared with them; no run depends on it."""
