"""The nodes of the twin; only here, and in bags, are messages touched."""
