"""Where a twin departs from its rig, what is missing, how far the gap shrinks once it is added."""
