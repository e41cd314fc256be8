"""The nodes of the twin; only here, and in bags, are messages touched."""

# First of all, as it notes which process started this one.
from . import ending as ending
