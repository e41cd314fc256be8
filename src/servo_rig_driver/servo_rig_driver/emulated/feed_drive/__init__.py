"""
The emulated feed drive: a ball screw of several bodies under a three-phase drive.

Finer than any twin of it and of other laws: currents in the stator's frame, a screw of nodes that
is held along by its bearings, balls that press as Hertz says, pitch errors, friction by bristles
that knows place and warmth. It meets the twin over CAN frames, topics and bags only.
"""
