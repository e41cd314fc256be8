"""The nodes of identification; only here, and in bags, are messages touched."""

# First of all, as it notes which process started this one.
from servo_twin.nodes import ending as ending
