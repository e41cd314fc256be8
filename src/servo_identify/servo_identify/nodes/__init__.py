"""The nodes of identification; only here, and in bags, are messages touched."""
