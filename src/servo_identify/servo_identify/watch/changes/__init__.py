"""Watching the residuals of a running twin: which balance changed, and since when."""
