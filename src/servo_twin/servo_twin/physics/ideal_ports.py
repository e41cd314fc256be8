"""
What each port gives when no effect acts there: the ideal servo.

The mechanisms are written against these names. A generated kernel puts in their place the sum or
the chain of the effects that its servo has (see :mod:`.kernel`); ``theta`` is the flat parameter
vector, ``on`` the switches, ``x`` the flat state with all memories.
"""


def motor_torque(theta, on, x, motion, h):
    """Sum of the torques on the motor shaft, N m."""
    return 0.0


def load_torque(theta, on, x, motion, h):
    """Sum of the torques on the load shaft, N m."""
    return 0.0


def motor_friction(theta, on, x, motion, h):
    """Sum of what resists the motor shaft, N m, not yet cut at zero."""
    return 0.0


def load_friction(theta, on, x, motion, h):
    """Sum of what resists the load shaft, N m, not yet cut at zero."""
    return 0.0


def mesh_error(theta, on, x, motion, h):
    """Sum of the angles lost by the shape of the teeth, rad at the load shaft."""
    return 0.0


def mesh_error_slope(theta, on, x, motion, h):
    """Growth of what the teeth lose with the motor angle, rad/rad: of errors that have one."""
    return 0.0


def mesh_clearance(theta, on, x, motion, h):
    """Sum of the gaps between the teeth, rad at the load shaft, not yet cut at zero."""
    return 0.0


def mesh_torque(theta, on, x, motion, h):
    """Torque of the mesh beside its linear stiffness and damping, N m on the load."""
    return 0.0


def added_inertia(theta, on, x, motion, h):
    """Inertia of the load shaft beside that of the mechanism, kg m2."""
    return 0.0


def added_inertia_slope(theta, on, x, motion, h):
    """Growth of the added inertia with the angle of the load itself, kg m2/rad."""
    return 0.0


def command_path(theta, on, x, motion, h):
    """The command as the drive gets it, V."""
    return motion.value


def current_path(theta, on, x, motion, h):
    """The current as the motor gets it, A."""
    return motion.value


def read_motor_position(theta, on, x, motion, h):
    """Reading of the motor encoder, rad."""
    return motion.value


def read_load_position(theta, on, x, motion, h):
    """Reading of the load encoder, rad."""
    return motion.value


def read_torque(theta, on, x, motion, h):
    """Reading of the torque sensor, N m."""
    return motion.value


def read_current(theta, on, x, motion, h):
    """Reading of the current sensor, A."""
    return motion.value


IDEAL_PORTS = {
    ('torque', 'motor'): motor_torque,
    ('torque', 'load'): load_torque,
    ('friction', 'motor'): motor_friction,
    ('friction', 'load'): load_friction,
    ('mesh_error', 'mesh'): mesh_error,
    ('mesh_error_slope', 'mesh'): mesh_error_slope,
    ('clearance', 'mesh'): mesh_clearance,
    ('mesh', 'mesh'): mesh_torque,
    ('inertia', 'load'): added_inertia,
    ('inertia_slope', 'load'): added_inertia_slope,
    ('drive', 'command'): command_path,
    ('drive', 'current'): current_path,
    ('sensor', 'motor_position'): read_motor_position,
    ('sensor', 'load_position'): read_load_position,
    ('sensor', 'torque'): read_torque,
    ('sensor', 'current'): read_current,
}
"""The fold of each port at each of its sites, and of the slopes of mesh errors and inertias."""
