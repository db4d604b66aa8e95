"""A flight as one HTML page: what was flown, how well, and what the filter saw."""
