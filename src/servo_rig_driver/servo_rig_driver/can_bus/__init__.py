"""The CAN bus: opening any kind of it, and one of our own between processes of one machine."""
