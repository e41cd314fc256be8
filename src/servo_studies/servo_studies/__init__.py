"""Studies: the papers' systems reproduced, real machines, and the blind check of the diagnosis."""
