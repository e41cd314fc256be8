"""The rig side of the servo twin: bus, driver node, recorder and emulated rig."""
