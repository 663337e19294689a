"""From what a maker prints of an actuator to a hammer file."""
