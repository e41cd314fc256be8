"""One step of a shaft that a torque pushes and friction resists."""


def slide(x, angle, direction, push, budget, inertia, h):
    """
    Advance one shaft by ``h`` under ``push`` (N m) against a friction ``budget`` (N m).

    ``x[angle]`` and ``x[angle + 1]`` are angle and speed, ``x[direction]`` and
    ``x[direction + 1]`` the way it last went and the angle where it last reversed. Friction takes
    from the speed at most what it can resist with, and stops at zero: sticking needs no threshold
    and no sign of zero. The form is that of Rhoban/bam (friction as a budget). Returns the torque
    with which friction did resist, N m, signed against the motion.
    """
    free = x[angle + 1] + h / inertia * push
    most = h / inertia * budget
    if free > most:
        speed = free - most
    elif free < -most:
        speed = free + most
    else:
        speed = 0.0
    x[angle + 1] = speed
    x[angle] += h * speed
    if speed * x[direction] < 0.0 or (x[direction] == 0.0 and speed != 0.0):
        x[direction] = 1.0 if speed > 0.0 else -1.0
        x[direction + 1] = x[angle] - h * speed
    return (speed - free) * (inertia / h)
