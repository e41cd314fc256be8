"""
How a servo runs from sample to sample.

These functions are copied into each kernel (see :mod:`.kernel`), where the folds, the drive, the
mechanism (`advance`) and the controller of its servo take the place of the names used here.
"""
# ruff: noqa: F821

from math import exp


def align(theta, on, x, torque):
    """Set the zero of the torsion so that the state as it stands carries `torque` (N m)."""
    mechanism = mechanism_of(theta)
    teeth = Teeth(x[MOTOR_ANGLE], x[LOAD_ANGLE], x[LOAD_DIRECTION], 0.0, torque,
                  x[MOTOR_ANGLE] / mechanism.ratio)
    lost = mesh_error(theta, on, x, teeth, 0.0)
    gap = 0.5 * max(mesh_clearance(theta, on, x, teeth, 0.0), 0.0)
    if torque < 0.0:
        gap = -gap
    elif torque == 0.0:
        gap = 0.0
    x[ZERO] = x[MOTOR_ANGLE] / mechanism.ratio - x[LOAD_ANGLE] - lost - gap
    x[ZERO] -= mechanism_rest(mechanism, torque)
    x[TORQUE] = torque


def run(theta, on, x, u, y, substeps, h, mode):
    """
    Advance the state `x` in place over the samples of `u`, and fill `y` with what sensors read.

    Row k of `y` is what stands at the instant of sample k, before its command acts; the state is
    left at the instant of the sample after the last. Each sample lasts `substeps` steps of `h`.
    """
    given, u, y = borrowed(x), borrowed(u), borrowed(y)
    theta, on, x = own(theta, THETA_SIZE), own(on, EFFECTS), own(x, STATE_SIZE)
    switch_off_vanished(theta, on)
    drive = drive_of(theta)
    mechanism = mechanism_of(theta)
    controller = controller_of(theta)
    period = substeps * h
    keep = exp(-observer_of(theta).bandwidth * period)
    samples = u.shape[0]
    for k in range(samples):
        following = min(k + 1, samples - 1)
        if mode == FORCED_MOTION:  # the last row goes on as the one before it
            before = max(following - 1, 0)
            x[MOTOR_ANGLE] = u[k, MEASURED_MOTOR]
            x[MOTOR_SPEED] = (u[following, MEASURED_MOTOR] - u[before, MEASURED_MOTOR]) / period

        # what the sensors read
        time, wanted = x[TIME], u[k, REFERENCE_POSITION]
        motor_at, load_at = x[MOTOR_ANGLE], x[LOAD_ANGLE]
        reading = Reading(motor_at, motor_at, x[MOTOR_SPEED], time, wanted)
        motor = read_motor_position(theta, on, x, reading, period)
        reading = Reading(load_at, load_at, x[LOAD_SPEED], time, wanted)
        load = read_load_position(theta, on, x, reading, period)
        y[k, 0], y[k, 1] = motor, load
        reading = Reading(x[TORQUE], load_at, x[LOAD_SPEED], time, wanted)
        y[k, 2] = read_torque(theta, on, x, reading, period)
        reading = Reading(x[CURRENT], motor_at, x[MOTOR_SPEED], time, wanted)
        y[k, 3] = read_current(theta, on, x, reading, period)

        # the measurements pull the state
        if mode == OBSERVER:
            ratio = mechanism.ratio
            of_motor = u[k, MEASURED_MOTOR] - motor
            of_load = u[k, MEASURED_LOAD] - load
            if of_motor != of_motor:
                of_motor = of_load * ratio
            if of_load != of_load:
                of_load = of_motor / ratio
            if of_motor == of_motor:
                x[MOTOR_ANGLE] += (1.0 - keep * keep) * of_motor
                x[MOTOR_SPEED] += (1.0 - keep) ** 2 * of_motor / period
                x[LOAD_ANGLE] += (1.0 - keep * keep) * of_load
                x[LOAD_SPEED] += (1.0 - keep) ** 2 * of_load / period

        # what the axis carries has moved, in kg m2/s
        before, x[COUPLED] = x[COUPLED], u[k, COUPLED_POSITION]
        grows = 0.0
        if before == before:
            earlier = Carried(load_at, before, time - period)
            grows = added_inertia(theta, on, x, Carried(load_at, x[COUPLED], time), period)
            grows = (grows - added_inertia(theta, on, x, earlier, period)) / period

        # the command
        command = u[k, VOLTAGE]
        if mode == CLOSED_LOOP:
            memory = x[CONTROLLER:CONTROLLER + CONTROLLER_SIZE]
            command = control_law(controller, memory, u[k, REFERENCE_POSITION],
                                  u[k, REFERENCE_VELOCITY], u[k, ADDED_COMMAND], motor, load,
                                  mechanism.ratio, period)
        y[k, 4] = command

        # up to the next sample
        external = u[k, EXTERNAL]
        temperature = u[k, TEMPERATURE] + 0.0 * u[k, TEMPERATURE]  # NaN where it is infinite
        for i in range(substeps):
            if mode == FORCED_CURRENT:
                share = (i + 0.5) / substeps
                x[CURRENT] = ((1.0 - share) * u[k, MEASURED_CURRENT]
                              + share * u[following, MEASURED_CURRENT])
            else:
                signal = Signal(command, x[MOTOR_SPEED], x[TIME])
                arrived = command_path(theta, on, x, signal, h)
                current = drive_law(drive, x, arrived, x[MOTOR_SPEED], h)
                signal = Signal(current, x[MOTOR_SPEED], x[TIME])
                x[CURRENT] = current_path(theta, on, x, signal, h)
            torque = drive.torque_constant * x[CURRENT]
            carried = Carried(x[LOAD_ANGLE], x[COUPLED], x[TIME])
            x[ADDED] = added_inertia(theta, on, x, carried, h)
            slope = added_inertia_slope(theta, on, x, carried, h)
            x[SWELL] = grows + 0.5 * slope * x[LOAD_SPEED]
            advance(mechanism, theta, on, x, torque, external, temperature, h)
    for i in range(STATE_SIZE):
        given[i] = x[i]
