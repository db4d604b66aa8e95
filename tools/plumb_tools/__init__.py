"""Python side of Plumb: scoring, reports and what the test run needs."""
