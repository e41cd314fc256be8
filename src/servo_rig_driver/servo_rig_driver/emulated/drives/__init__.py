"""Drives that answer requests, as people buy them, around the emulated machine."""
