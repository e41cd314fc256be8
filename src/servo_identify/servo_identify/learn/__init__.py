"""Models learned from recordings: friction, transmission, networks."""
