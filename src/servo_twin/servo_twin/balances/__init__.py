"""Torque balances and the other equations of a servo, and how far a recording is off them."""
