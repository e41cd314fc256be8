"""Device protocols: what a drive and its sensors say on the bus, as tables and small classes."""
