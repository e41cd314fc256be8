"""
What the laws of a servo say along a motion that was measured, part by part.

Nothing is integrated here but the memories of the laws and the current. Each part of the servo is
shown what its neighbours were measured to do. So an error of one part does not spread to the
others, and nothing drifts. Copied into each kernel, as :mod:`.rollout` is.
"""
# ruff: noqa: F821

MOTION = (
    'motor_angle', 'motor_speed', 'load_angle', 'load_speed', 'load_acceleration', 'torque',
    'wind_up', 'wind_up_rate', 'current', 'external', 'temperature', 'coupled_angle',
)
EVALUATED = (
    'motor_push', 'motor_resistance', 'load_push', 'load_resistance', 'mesh_torque', 'torque',
    'lost', 'half_gap', 'spring',
)


def evaluate_models(theta, on, x, motion, out, h):
    """
    Evaluate the laws along `motion`, shape (samples, len(MOTION)); fill `out`, likewise EVALUATED.

    The torsion is ``motor / ratio - load`` with its zero taken off; torque (N m on the load) may
    be NaN, then it is what the load side takes. ``lost`` is the kinematic error and ``half_gap``
    half the clearance (rad at the load), ``spring`` the torque of the effects in the mesh. What
    the load carries beside its own inertia pushes it back. A resistance is signed against the
    motion. While a shaft stands still its resistance is the
    full budget, which it need not spend: leave such samples out.
    """
    theta, on, x = borrowed(theta), borrowed(on), borrowed(x)
    mechanism = mechanism_of(theta)
    motor_way, load_way = 1.0, 1.0
    motor_turned, load_turned = motion[0, 0], motion[0, 2]
    carried = 0.0
    for k in range(motion.shape[0]):
        motor, motor_speed, load, load_speed = (motion[k, 0], motion[k, 1], motion[k, 2],
                                                motion[k, 3])
        wind_up, rate, current, temperature = (motion[k, 6], motion[k, 7], motion[k, 8],
                                               motion[k, 10])
        time = k * h
        if motor_speed * motor_way < 0.0:
            motor_way, motor_turned = -motor_way, motor
        if load_speed * load_way < 0.0:
            load_way, load_turned = -load_way, load
        measured = motion[k, 5]
        torque = measured if measured == measured else carried

        teeth = Teeth(motor, load, load_way, abs(load - load_turned), torque,
                      motor / mechanism.ratio)
        lost = mesh_error(theta, on, x, teeth, h)
        left = wind_up - lost
        half = 0.5 * max(mesh_clearance(theta, on, x, teeth, h), 0.0)
        left -= min(max(-half, left), half)
        touching = half == 0.0 or left != 0.0
        slope = mesh_error_slope(theta, on, x, teeth, h)
        rate = rate - motor_speed * slope if touching else 0.0
        spring = mesh_torque(theta, on, x, WindUp(left, rate, load), h)
        out[k, 4] = mechanism_pull(mechanism, left, rate) + spring
        out[k, 6], out[k, 7], out[k, 8] = lost, half, spring

        at_load = Shaft(load, load_speed, load_way, torque, abs(load - load_turned), current,
                        temperature, time)
        push = load_torque(theta, on, x, at_load, h)
        added = Carried(load, motion[k, 11], time)
        first, then = max(k - 1, 0), min(k + 1, motion.shape[0] - 1)
        swell = added_inertia(theta, on, x, Carried(load, motion[then, 11], then * h), h)
        swell -= added_inertia(theta, on, x, Carried(load, motion[first, 11], first * h), h)
        swell /= max(then - first, 1) * h
        swell += 0.5 * added_inertia_slope(theta, on, x, added, h) * load_speed
        inertia = added_inertia(theta, on, x, added, h)
        push -= inertia * motion[k, 4] + swell * load_speed
        resistance = -load_way * max(load_friction(theta, on, x, at_load, h), 0.0)
        carried = (mechanism.load_inertia * motion[k, 4] + motion[k, 9] - push - resistance)
        out[k, 2], out[k, 3] = push, resistance

        felt = torque / mechanism.ratio
        at_motor = Shaft(motor, motor_speed, motor_way, felt, abs(motor - motor_turned), current,
                         temperature, time)
        out[k, 0] = motor_torque(theta, on, x, at_motor, h)
        out[k, 0] += torque * slope
        out[k, 1] = -motor_way * max(motor_friction(theta, on, x, at_motor, h), 0.0)
        out[k, 5] = torque


def kinematic_error(theta, on, x, motion, lost, h):
    """Fill `lost` (rad at the load) with what the shape of the teeth takes along `motion`."""
    theta, on, x = borrowed(theta), borrowed(on), borrowed(x)
    way, turned = 1.0, motion[0, 2]
    for k in range(motion.shape[0]):
        if motion[k, 3] * way < 0.0:
            way, turned = -way, motion[k, 2]
        teeth = Teeth(motion[k, 0], motion[k, 2], way, abs(motion[k, 2] - turned), motion[k, 5],
                      motion[k, 0] / mechanism.ratio)
        lost[k] = mesh_error(theta, on, x, teeth, h)


def drive_current(theta, on, x, voltage, motor_speed, current, substeps, h):
    """
    Fill `current` (samples, 2) with what the drive makes of `voltage` (V) at `motor_speed`, A.

    At each sample, before its voltage acts, and in the mean from there to the next. The voltage is
    held from sample to sample, the speed (rad/s) goes straight from one to the next.
    """
    theta, on, x = borrowed(theta), borrowed(on), borrowed(x)
    drive = drive_of(theta)
    last = len(voltage) - 1
    for k in range(len(voltage)):
        current[k, 0], total = x[CURRENT], 0.0
        change = (motor_speed[min(k + 1, last)] - motor_speed[k]) / substeps
        for i in range(substeps):
            speed = motor_speed[k] + (i + 0.5) * change
            arrived = command_path(theta, on, x, Signal(voltage[k], speed, x[TIME]), h)
            x[CURRENT] = drive_law(drive, x, arrived, speed, h)
            x[CURRENT] = current_path(theta, on, x, Signal(x[CURRENT], speed, x[TIME]), h)
            total += x[CURRENT]
            x[MOTOR_ANGLE] += h * speed
            x[TIME] += h
        current[k, 1] = total / substeps


def sensor_readings(theta, on, x, truth, readings, period):
    """Fill `readings` with what the sensors make of `truth`; both (samples, 4) as OUTPUTS."""
    theta, on, x = borrowed(theta), borrowed(on), borrowed(x)
    for k in range(truth.shape[0]):
        time, at = k * period, min(k, truth.shape[0] - 2)
        motor, load = truth[k, 0], truth[k, 1]
        # up to the next sample: what changes from one speed to the next does so about the sample
        motor_speed = (truth[at + 1, 0] - truth[at, 0]) / period
        load_speed = (truth[at + 1, 1] - truth[at, 1]) / period
        reading = Reading(motor, motor, motor_speed, time, 0.0)
        readings[k, 0] = read_motor_position(theta, on, x, reading, period)
        reading = Reading(load, load, load_speed, time, 0.0)
        readings[k, 1] = read_load_position(theta, on, x, reading, period)
        reading = Reading(truth[k, 2], load, load_speed, time, 0.0)
        readings[k, 2] = read_torque(theta, on, x, reading, period)
        reading = Reading(truth[k, 3], motor, motor_speed, time, 0.0)
        readings[k, 3] = read_current(theta, on, x, reading, period)


def controller_output(theta, on, x, references, motor, load, command, period):
    """
    Fill `command` (V) with the controller's answer to `references`.

    Their columns: position (rad), speed (rad/s) and, where there is a third, what is added (V).
    """
    controller = controller_of(theta)
    ratio = mechanism_of(theta).ratio
    for k in range(len(motor)):
        memory = x[CONTROLLER:CONTROLLER + CONTROLLER_SIZE]
        added = references[k, 2] if references.shape[1] > 2 else 0.0
        command[k] = control_law(controller, memory, references[k, 0], references[k, 1], added,
                                 motor[k], load[k], ratio, period)
