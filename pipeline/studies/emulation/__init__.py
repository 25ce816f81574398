"""Emulated numbers compared with those of many runs, case by case."""
