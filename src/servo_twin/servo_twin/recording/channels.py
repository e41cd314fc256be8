"""The columns of a recording and their units."""

COLUMNS = {
    'voltage': 'V',
    'current_reference': 'A',
    'current': 'A',
    'motor_position': 'rad',
    'load_position': 'rad',
    'torque': 'N m',
    'external_torque': 'N m',
    'reference_position': 'rad',
    'reference_velocity': 'rad/s',
    'temperature': 'degC',
    'coupled_position': 'rad',
    'added_command': 'V',
}
"""Columns besides the time `t`, with their units; one that was not measured is NaN throughout."""

MAY_BE_EMPTY = ('added_command',)
"""Columns whose field a message leaves empty where nothing is recorded of them."""
