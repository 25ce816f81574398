"""Files that a scenario names: elevation tables and models, points, outlines and reference systems."""
