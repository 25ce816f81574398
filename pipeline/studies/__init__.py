"""Measurements of the product itself: benchmarks, profiles, scans and campaigns; no run depends on them."""
