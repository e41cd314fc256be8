"""The limits of an experiment where nobody gives others."""

UNITS = {'speed': 'rad/s', 'torque': 'N m', 'travel': 'rad', 'current': 'A'}
"""Unit of each at the load; of a load that moves straight m/s, N and m."""
USUAL = {'speed': 3.0, 'torque': 300.0, 'travel': 7.0, 'current': 4.0}
"""Those of a load that turns."""
