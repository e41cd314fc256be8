"""Joints of rigid-body simulators: read as servos, written from servos, compared with the twin."""
