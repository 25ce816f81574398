"""From stores to probabilities, tables, receptors, sensitivity and calibration."""
