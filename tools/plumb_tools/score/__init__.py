"""Scores an estimated trajectory against the truth; `tools/score --help` tells how to use it."""
