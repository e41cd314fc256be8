"""
The emulated feed drive: a ball screw of several bodies under a three-phase drive.

It is finer than any twin of it and has other laws. Currents are in the stator's frame; a screw of
nodes is held along by its bearings; balls press as Hertz says. Pitch errors, and friction that
depends on place and temperature, are there too. It meets the twin over CAN frames, topics and bags
only.
"""
