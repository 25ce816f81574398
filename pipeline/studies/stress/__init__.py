"""The stress campaign: random scenes, the laws they must keep, and the shrinking of those that fail."""
