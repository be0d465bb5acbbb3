"""Where things are in a simulated cell."""

XyzMm = tuple[float, float, float]
"""X, Y, Z in mm, in the robot's base frame."""
