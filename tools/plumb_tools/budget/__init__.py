"""What the flight software may cost, and what it costs."""
