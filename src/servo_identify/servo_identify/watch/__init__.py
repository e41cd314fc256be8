"""Beside a running rig: slow changes tracked, sudden ones detected."""
