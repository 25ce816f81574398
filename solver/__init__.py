"""Depth-averaged granular flow by local moving least squares: arrays in, arrays out."""
