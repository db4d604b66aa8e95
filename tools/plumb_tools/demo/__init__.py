"""From a scene to the report: simulate, fly with and without range, score, show. The demo and the suite share it."""
