"""From a file and a few values to a servo file and a mapping file."""
