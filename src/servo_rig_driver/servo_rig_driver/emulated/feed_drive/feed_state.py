"""The memory of the emulated feed drive: one record, with named fields."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

NODES = 3  # of the screw: at one bearing, between them, at the other
BRISTLES = 3

STATE = np.dtype([
    ('time', 'f8'),
    ('motor_angle', 'f8'), ('motor_speed', 'f8'),          # rad, rad/s
    ('angles', 'f8', NODES), ('speeds', 'f8', NODES),      # of the screw
    ('along', 'f8'), ('along_speed', 'f8'),                # m, of the screw in its bearings
    ('table', 'f8'), ('table_speed', 'f8'),                # m, m/s
    ('stretch', 'f8'),                                     # m, of the screw to the nut
    ('force', 'f8'),                                       # N, of the nut on the table
    ('ways_bristles', 'f8', BRISTLES), ('nut_bristles', 'f8', BRISTLES),
    ('bearing_bristles', 'f8', BRISTLES),
    ('age', 'f8'),                                         # s/m, of the contacts of the ways
    ('temperature', 'f8'), ('first_temperature', 'f8'),    # degC
    ('external', 'f8'), ('external_target', 'f8'),         # N
    ('current_alpha', 'f8'), ('current_beta', 'f8'),       # A, in the stator's frame
    ('voltages', 'f8', 3), ('next_voltages', 'f8', 3),     # V, of the phases: now, and computed
    ('waited', 'f8'), ('runs', 'f8'),                      # s, and runs of the current loop
    ('last_angle', 'f8'), ('speed_estimate', 'f8'),        # rad, rad/s: of the velocity loop
    ('velocity_sum', 'f8'), ('sum_d', 'f8'), ('sum_q', 'f8'), ('wanted', 'f8'),
    ('current', 'f8'),                                     # A, q current as measured
    ('command', 'f8'), ('mode', 'f8'), ('target', 'f8'),   # V; A in current mode
])


def fresh_state(values: Mapping[str, float], seed: int = 0) -> np.ndarray:
    """Return an array of one record: at rest at zero, as warm as ``values`` say."""
    state = np.zeros(1, STATE)
    state['temperature'] = state['first_temperature'] = values['thermal.start']
    state['age'] = 1e3
    return state
