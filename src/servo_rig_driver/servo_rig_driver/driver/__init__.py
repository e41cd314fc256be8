"""The driver node: from samples on the bus to topics, and from set-points to the bus."""
