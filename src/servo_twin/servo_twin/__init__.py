"""The servo twin: physics, lockstep model, twin node and bags."""
