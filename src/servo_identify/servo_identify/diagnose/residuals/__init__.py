"""Residuals of the equations of a servo along what was measured."""
