"""Rig, driver, twin and recorder as processes that live and end together."""
