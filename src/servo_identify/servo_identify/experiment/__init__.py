"""Experiments: the procedures that a rig is driven through, their limits, and who does it."""
