"""The diagnosis of the sim-to-real gap."""
