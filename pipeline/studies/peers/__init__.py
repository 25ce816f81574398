"""Runs on elevation models beside those of another code: ``python -m pipeline.studies.peers FOLDER``."""
