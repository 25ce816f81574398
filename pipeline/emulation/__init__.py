"""Emulated numbers of a scenario: stores brought to the emulator, and tables and maps of what it gives."""
