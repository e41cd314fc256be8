"""The limits of an experiment where nobody gives others."""

USUAL = {'speed': 3.0, 'torque': 300.0, 'travel': 7.0, 'current': 4.0}
"""Speed (rad/s), torque (N m) and travel (rad) at the load, current in A."""
