"""Calibration files of other tools, made into those that Plumb reads."""
