"""A machine as a servo file: read, written, shipped, documented."""
