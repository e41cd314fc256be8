"""Joints of models read, and as servos."""
