"""Slowly varying quantities of a running rig, tracked recursively with their uncertainty."""
