"""From accepted mechanisms to a servo file: curves, laws, refit by simulation, comparison."""
