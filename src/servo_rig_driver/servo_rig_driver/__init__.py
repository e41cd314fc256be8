"""The rig side of the servo twin: bus, driver node, recorder and emulated rig."""

# First of all, as it notes which process started this one.
from . import ending as ending
