"""Backlash and transmission error, learned from turns in both directions."""
