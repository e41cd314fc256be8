"""Servos as the nearest joint that a simulator can hold, and that joint written."""
