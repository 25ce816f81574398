"""Hazard maps: thresholds, intensity classes, and the files and pictures of the maps."""
