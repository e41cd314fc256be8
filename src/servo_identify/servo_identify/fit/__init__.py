"""Physical parameters from recordings, by output error."""
