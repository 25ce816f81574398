"""What a place holds: variables, Zarr stores, their storage, locks, status and provenance."""
