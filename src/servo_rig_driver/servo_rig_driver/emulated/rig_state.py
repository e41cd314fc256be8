"""The memory of the simulation: one record, with named fields."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

RING = 1024  # substeps that delays can look back
LOAD_BRISTLES, MOTOR_BRISTLES, MESH_BRISTLES = 4, 2, 3

STATE = np.dtype([
    ('time', 'f8'),                                        # s since the start
    ('motor_angle', 'f8'), ('motor_speed', 'f8'),          # rad, rad/s
    ('load_angle', 'f8'), ('load_speed', 'f8'),
    ('payload_angle', 'f8'), ('payload_speed', 'f8'),
    ('slosh_speed', 'f8'),                                 # of the liquid, rad/s
    ('load_bristles', 'f8', LOAD_BRISTLES),                # rad, deflections
    ('motor_bristles', 'f8', MOTOR_BRISTLES),
    ('mesh_bristles', 'f8', MESH_BRISTLES),
    ('age', 'f8'),                                         # s/rad, of the contacts
    ('rest', 'f8'),                                        # s, since the load last slid
    ('load_stuck', 'f8'), ('motor_stuck', 'f8'),           # N m/rad, of bristles that hold
    ('wind_up', 'f8'), ('mesh_torque', 'f8'), ('mesh_slope', 'f8'),
    ('motor_force', 'f8'), ('load_force', 'f8'), ('payload_force', 'f8'),  # N m, by position
    ('flex_torque', 'f8'), ('creep_torque', 'f8'),         # N m, of the flexspline
    ('other_angle', 'f8'), ('other_speed', 'f8'),          # of the other axis, from its start
    ('reaction', 'f8'),                                    # N m, that the other axis feels
    ('slow_torque', 'f8'),                                 # N m, magnitude that opens the backlash
    ('current', 'f8'), ('current_integral', 'f8'),         # A, V
    ('brake_phase', 'f8'),                                 # rad, of its control at the start
    ('external', 'f8'), ('external_rate', 'f8'), ('external_target', 'f8'),
    ('temperature', 'f8'), ('heat', 'f8'),             # degC, W
    ('torque_reading', 'f8'), ('torque_zero', 'f8'),
    ('command', 'f8'),                                     # V, held since the last SYNC
    ('commands', 'f8', RING), ('load_angles', 'f8', RING), ('at', 'i8'),
    ('started', 'f8'), ('last_angle', 'f8'), ('speed_estimate', 'f8'), ('integral', 'f8'),
])


def fresh_state(values: Mapping[str, float], seed: int = 0) -> np.ndarray:
    """
    Return an array of one record: at rest at zero, the gearbox as warm as ``values`` say.

    ``seed`` says how the brake's disc happens to stand.
    """
    state = np.zeros(1, STATE)
    state['temperature'] = values['thermal.start']
    state['age'] = 50.0
    state['brake_phase'] = np.random.default_rng([seed, 1]).uniform(0.0, 2.0 * np.pi)
    return state
