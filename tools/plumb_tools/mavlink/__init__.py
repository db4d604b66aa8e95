"""MAVLink: what Plumb knows, in the messages, frames and units that autopilots read."""
