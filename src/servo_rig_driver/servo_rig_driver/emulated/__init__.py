"""
The emulated rig: a small simulator with physics of its own, finer than the twin's catalogue.

It shares no law with servo_twin: the two meet over CAN frames, topics and bags only.
"""
