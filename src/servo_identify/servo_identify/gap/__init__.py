"""Where a twin departs from its rig, which effect causes it, how far the gap shrinks."""
