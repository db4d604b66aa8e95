"""Values on a command line: what argparse is to say of a bad one."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable

#: Where plumb-fsw and plumb-replay publish as their documents have it.
LCM_URL = "udpm://239.255.76.67:7667?ttl=0"


def _finite(text: str, expected: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text!r}; expected {expected}")
    return value


def seconds(text: str) -> float:
    """A time, of either sign."""
    return _finite(text, "a number of seconds")


def _positive(text: str, expected: str) -> float:
    value = _finite(text, expected)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f"{text!r}; expected {expected}")
    return value


def number(text: str) -> float:
    """A number that is finite."""
    return _finite(text, "a number")


def positive_number(text: str) -> float:
    """A number above zero."""
    return _positive(text, "a positive number")


def positive_seconds(text: str) -> float:
    """A length of time."""
    return _positive(text, "a positive number of seconds")


def whole_number(low: int, high: int | None = None) -> Callable[[str], int]:
    """Reads a whole number within limits, both included."""
    expected = f"a whole number of at least {low}" if high is None else f"a whole number from {low} to {high}"

    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = low - 1
        if value < low or (high is not None and value > high):
            raise argparse.ArgumentTypeError(f"{text!r}; expected {expected}")
        return value

    return read
