"""The page of a diagnosis: one file to be read, zoomed into and copied from, offline."""
