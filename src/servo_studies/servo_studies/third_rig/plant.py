"""What a machine of the third rig is: drive, shafts, gear, loop and sensors as numbers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

SPEED_PI, POSITION_LOOP, CASCADE = 1, 2, 3  # kinds of `controller`
CONSTANT, FIRST_ORDER, MEAN = 1, 2, 3  # of a reading that is late
SECOND_ORDER, SLEW = 2, 3  # of `lag_kind`, beside FIRST_ORDER
LINEAR, SWINGING, HARDENING, DRY = 1, 2, 3, 4  # of `hung_kind`


class Plant(NamedTuple):
    """What the machine is; SI units, each torque at its own shaft; what is 0 is not there."""

    ratio: float
    rotor_inertia: float
    load_inertia: float
    stiffness: float               # N m/rad, seen from the load
    damping: float                 # N m s/rad
    torque_constant: float
    gain: float                    # A/V, or V/V of a machine with a resistance
    resistance: float = 0.0
    inductance: float = 0.0
    back_emf: float = 0.0
    motor_coulomb: float = 0.0
    motor_viscous: float = 0.0
    load_coulomb: float = 0.0
    load_viscous: float = 0.0
    gap: float = 0.0               # rad of the load, from flank to flank
    controller: float = 0.0
    kp: float = 0.0
    kv: float = 0.0
    ki: float = 0.0
    kd: float = 1.0
    kf: float = 0.0
    filter: float = 0.0            # s
    speed_limit: float = 1e9       # rad/s
    limit: float = 10.0            # V
    lag_kind: float = 0.0          # of the current
    lag: float = 0.0               # s; of SLEW: A/s
    ring_inertia: float = 0.0      # on the rotor behind a film
    ring_time: float = 0.0         # s
    hung_kind: float = 0.0         # what hangs on the load by a spring
    hung_inertia: float = 0.0
    hung_frequency: float = 0.0    # Hz, load held
    hung_damping: float = 0.0      # of critical
    hung_shape: float = 0.0        # 1/rad of SWINGING, 1/rad2 of HARDENING, N m of DRY
    gap_time: float = 0.0          # s, of the gap that a load opens
    crush: float = 0.0             # rad of contact at which the damping is there in full
    oil: float = 0.0               # N m s/rad inside the gap
    clutch: float = 0.0            # N m at which the coupling slips
    clutch_drag: float = 1.0       # N m s/rad of slip
    rest_travel: float = 1e-3      # rad of sliding that ends a rest
    flank_travel: float = 1e-3     # rad of the load after a reversal
    heat: float = 0.0              # K/J
    cooling: float = 60.0          # s
    motor_late_kind: float = 0.0
    motor_late: float = 0.0        # s
    load_late_kind: float = 0.0
    load_late: float = 0.0
    torque_late_kind: float = 0.0
    torque_late: float = 0.0
    motor_count: float = 0.0       # rad
    load_count: float = 0.0
    torque_count: float = 0.0      # N m
    current_count: float = 0.0     # A

    def as_record(self) -> np.record:
        """Return the same for compiled code, which passes a record by its address."""
        return np.array([tuple(self)], dtype=[(name, float) for name in self._fields])[0]
