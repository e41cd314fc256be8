"""The flat state of a servo: what the first numbers of it mean; memories follow."""

MOTOR_ANGLE, MOTOR_SPEED, LOAD_ANGLE, LOAD_SPEED = 0, 1, 2, 3  # rad, rad/s
CURRENT, TORQUE, TIME = 4, 5, 6  # A, N m on the load, s
MOTOR_DIRECTION, MOTOR_REVERSAL = 7, 8  # +1 or -1; rad, where the shaft last reversed
LOAD_DIRECTION, LOAD_REVERSAL = 9, 10
ZERO = 11  # rad at the load shaft: motor angle / ratio - load angle where the torsion is zero
COUPLED = 12  # rad, angle of the axis that changes this one's inertia; NaN before the first sample
ADDED, SWELL = 13, 14  # kg m2, kg m2/s: inertia of the load beside the mechanism's, its growth
CONTROLLER = 15  # first of the controller's numbers
CONTROLLER_SIZE = 4
PARTS = CONTROLLER + CONTROLLER_SIZE  # first of the memories of the drive, then the mechanism's

STATE = (
    'motor_angle', 'motor_speed', 'load_angle', 'load_speed', 'current', 'torque', 'time',
    'motor_direction', 'motor_reversal', 'load_direction', 'load_reversal',
    'zero', 'coupled_angle', 'added_inertia', 'swell',
)

INPUTS = (
    'voltage', 'current', 'reference_velocity', 'reference_position', 'external_torque',
    'temperature', 'motor_position', 'load_position', 'coupled_position', 'added_command',
)
VOLTAGE, MEASURED_CURRENT, REFERENCE_VELOCITY, REFERENCE_POSITION = 0, 1, 2, 3
EXTERNAL, TEMPERATURE, MEASURED_MOTOR, MEASURED_LOAD, COUPLED_POSITION = 4, 5, 6, 7, 8
ADDED_COMMAND = 9

OUTPUTS = ('motor_position', 'load_position', 'torque', 'current', 'voltage')

MEASURED_INPUT, CLOSED_LOOP, OBSERVER, FORCED_CURRENT, FORCED_MOTION = 0, 1, 2, 3, 4
MODES = {
    'measured_input': MEASURED_INPUT,
    'closed_loop': CLOSED_LOOP,
    'observer': OBSERVER,
    'forced_current': FORCED_CURRENT,
    'forced_motion': FORCED_MOTION,
}
