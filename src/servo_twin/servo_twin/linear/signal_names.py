"""The inputs and outputs that a linear form may have, with units, and what friction is there."""

INPUT_UNITS = {'voltage': 'V', 'current': 'A', 'external_torque': 'N m',
               'reference_velocity': 'rad/s', 'reference_position': 'rad'}
OUTPUT_UNITS = {'motor_speed': 'rad/s', 'load_speed': 'rad/s', 'motor_position': 'rad',
                'load_position': 'rad', 'torque': 'N m', 'current': 'A'}
FRICTIONS = ('sliding', 'none', 'stuck')
