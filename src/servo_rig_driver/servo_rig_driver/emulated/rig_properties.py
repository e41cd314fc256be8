"""
Everything that the emulated rig can be told: one line a property.

A property of kind "scale" turns one effect of the rig: 0 off, 1 as on the bench, 2 twice as
strong. The others are quantities with a unit. `withheld.*` are effects that the bench does not
have, 0 off; they exist to be found. The keys of config/rigs/*.yaml are the paths here.
"""

from __future__ import annotations

from typing import NamedTuple


class Property(NamedTuple):
    """One number: path in the rig file, default, unit ('' for a scale), bounds and meaning."""

    path: str
    default: float
    unit: str
    low: float
    high: float
    meaning: str

    @property
    def name(self) -> str:
        """The path as a field name of the compiled simulation."""
        return self.path.replace('.', '_')


def _scale(path: str, meaning: str, default: float = 1.0) -> Property:
    return Property(path, default, '', 0.0, 100.0, meaning)


BIG = 1e12

PROPERTIES = (
    # paper 000, table 3, unless said otherwise
    Property('machine.ratio', 161.0, '', 0.01, 1e4, 'Turns of the motor for one of the load.'),
    Property('machine.rotor_inertia', 1.14e-4, 'kg m^2', 1e-9, 1e3, 'Motor shaft.'),
    Property('machine.load_inertia', 5.76, 'kg m^2', 1e-9, 1e6, 'Load shaft.'),
    Property('machine.stiffness', 5e5, 'N m/rad', 1.0, 1e9, 'All tooth pairs in contact.'),
    Property('machine.torque_constant', 0.4878, 'N m/A', 1e-6, 100.0, 'And V s/rad of back-EMF.'),
    Property('machine.damping', 60.0, 'N m s/rad', 0.0, BIG, 'Of the mesh when in contact.'),

    Property('drive.current_loop', 1.0, '', 0.0, 1.0,
             '1: the command is a current reference, 0: it is the winding voltage.'),
    Property('drive.gain', 0.49, 'A/V', 1e-6, 1e3, 'K_a, current for one volt of command.'),
    Property('drive.command_limit', 10.0, 'V', 1e-3, 1e3, 'Largest command.'),
    Property('drive.current_limit', 15.0, 'A', 1e-3, 1e3, 'Largest current reference.'),
    Property('drive.supply', 300.0, 'V', 1e-1, 1e4, 'Voltage of the intermediate circuit.'),
    Property('drive.resistance', 1.1, 'ohm', 1e-3, 1e3, 'Of the winding.'),
    Property('drive.inductance', 4.5e-3, 'H', 1e-7, 10.0, 'Of the winding.'),
    Property('drive.bandwidth', 900.0, 'Hz', 1.0, 1e4, 'Of the current loop.'),
    _scale('drive.current_lag', 'Slowness of the current: scales inductance and 1/bandwidth.'),
    _scale('drive.latency', 'Of the set-point in the drive: 1 is 60 us.'),
    _scale('drive.current_integral', 'Integral action of the current loop; 0: gain alone.'),
    Property('drive.velocity_gain', 16.09, 'V s/rad', 0.0, BIG, 'K_p, on load-side speed.'),
    Property('drive.velocity_integral', 505.38, 'V/rad', 0.0, BIG, 'K_i, on load-side speed.'),
    Property('drive.velocity_filter', 0.0, 's', 0.0, 1.0, 'Low-pass of the measured speed.'),
    Property('drive.position_gain', 20.0, '1/s', 0.0, BIG, 'Speed for one radian of error.'),
    Property('drive.velocity_limit', 2.0, 'rad/s', 1e-3, BIG, 'Of the position loop, load side.'),
    _scale('drive.load_feedback', 'Where the position loop looks: 0 motor, 1 load encoder.', 0.0),

    Property('friction.load_coulomb', 18.0, 'N m', 0.0, BIG, 'Sliding level at the load.'),
    Property('friction.motor_coulomb', 0.03, 'N m', 0.0, BIG, 'Sliding level at the motor.'),
    Property('friction.load_viscous', 14.0, 'N m s/rad', 0.0, BIG, 'Slope at the load.'),
    Property('friction.motor_viscous', 1e-4, 'N m s/rad', 0.0, BIG, 'Slope at the motor.'),
    Property('friction.presliding_angle', 6e-5, 'rad', 1e-9, 1.0, 'Of the load until it slides.'),
    Property('friction.fade_speed', 0.02, 'rad/s', 1e-6, BIG, 'Where speed weakening ends.'),
    Property('friction.shear_speed', 1.0, 'rad/s', 1e-6, BIG, 'Where the lubricant thins.'),
    Property('friction.load_coefficient', 0.06, '', 0.0, 10.0, 'Growth for one N m transmitted.'),
    Property('friction.renewal_angle', 2e-4, 'rad', 1e-9, 1.0, 'In which contacts renew.'),
    _scale('friction.level', 'Sliding levels of both shafts.'),
    _scale('friction.load_level', 'Sliding level of the load.'),
    _scale('friction.motor_level', 'Sliding level of the motor.'),
    _scale('friction.viscous', 'Viscous friction of both shafts.'),
    _scale('friction.thinning', 'Lubricant that thins with speed; 0 is linear.'),
    _scale('friction.weakening', 'Excess at low speed and after rest (rate and state).'),
    _scale('friction.presliding', 'Compliance before sliding; 0 is nearly rigid.'),
    _scale('friction.position', 'Variation over the turn of the load; 1 is some 15 %.'),
    _scale('friction.load', 'Growth with the transmitted torque.'),
    _scale('friction.asymmetry', 'Difference by direction; 1 is 5 % to either side.'),
    _scale('friction.temperature', 'Fall with temperature.'),

    # a disc brake on the motor shaft and a movable carrier of the load encoder, as paper 002 has
    Property('brake.torque', 0.0, 'N m', 0.0, BIG, 'Asked of the disc brake on the motor shaft.'),
    _scale('brake.runout', 'Variation over the turn of the disc; 1 is 3 %.'),
    _scale('brake.swing', 'Oscillation of the force control, begun at random; 1 is 4 %.'),
    Property('brake.frequency', 3.7, 'Hz', 0.0, 1e3, 'Of that oscillation.'),
    _scale('brake.grip', 'Excess of a disc that hardly turns; 1 is 5 %.'),
    Property('brake.fade_speed', 2.0, 'rad/s', 1e-6, BIG, 'Of the disc, at half of it.'),

    Property('carrier.setting', 0.0, 'm', 0.0, 0.1, 'Where the slide of the encoder is.'),
    Property('carrier.zero', 0.0, 'm', 0.0, 0.1, 'Setting at which both flanks touch.'),
    Property('carrier.base', 0.09, 'm', 1e-3, 10.0, 'Distance of the shafts at that setting.'),
    Property('carrier.radius', 0.045, 'm', 1e-3, 10.0, 'Pitch circle of the gear on the encoder.'),
    Property('carrier.pressure_angle', 0.349, 'rad', 0.1, 0.7, 'Of the teeth.'),
    Property('carrier.depth', 0.006, 'm', 1e-4, 0.1, 'Way of the slide from flanks that touch to '
             'teeth that part.'),
    _scale('carrier.arc', 'Flanks that are arcs and no involutes; 1 is 0.25 mm of backlash.'),
    _scale('carrier.waviness', 'Printed flanks: play that swings as it opens; 1 is 0.03 mm.'),

    Property('thermal.capacity', 600.0, 'J/K', 1e-3, BIG, 'Of the gearbox.'),
    Property('thermal.cooling', 1.0, 'W/K', 1e-6, BIG, 'To the room.'),
    Property('thermal.room', 25.0, 'degC', -50.0, 100.0, 'Temperature of the room.'),
    Property('thermal.start', 25.0, 'degC', -50.0, 150.0, 'Gearbox at the beginning.'),
    _scale('thermal.heating', 'Heat of friction that stays in the gearbox.'),

    Property('mesh.gap', 2.6e-4, 'rad', 0.0, 1.0, 'Free play at the load without torque.'),
    Property('mesh.stagger', 8e-5, 'rad', 0.0, 1.0, 'Torsion until the last tooth pair bears.'),
    Property('mesh.opening_torque', 30.0, 'N m', 1e-9, BIG, 'Where half the growth is reached.'),
    Property('mesh.slip_torque', 1.0, 'N m', 0.0, BIG, 'Of all micro-slip contacts.'),
    Property('mesh.slip_angle', 4e-5, 'rad', 1e-9, 1.0, 'Torsion in which they slip.'),
    _scale('mesh.backlash', 'Free play.'),
    _scale('mesh.backlash_load', 'Growth of the backlash with the torque; 1 is up to 50 %.'),
    _scale('mesh.backlash_position', 'Variation of the backlash over the turn; 1 is 35 %.'),
    _scale('mesh.softening', 'Softness at small torque: tooth pairs that bear one by one.'),
    _scale('mesh.hysteresis', 'Micro-slip in the mesh.'),
    _scale('mesh.damping', 'Damping of the mesh.'),

    Property('error.order', 40.0, '', 1.0, 1000.0, 'Teeth: orders are this and its multiples.'),
    Property('error.amplitude', 7e-5, 'rad', 0.0, 1.0, 'At the first multiple.'),
    Property('error.turn_amplitude', 8e-5, 'rad', 0.0, 1.0, 'At order 1, half of it at 2.'),
    _scale('error.tooth', 'Transmission error at the orders of the teeth.'),
    _scale('error.turn', 'Transmission error at orders 1 and 2 of the load turn.'),
    _scale('error.direction', 'Difference of the error between the flanks.'),

    _scale('flexspline.fitted', '1: a harmonic drive in place of the toothed mesh, 0: none.', 0.0),
    Property('flexspline.tooth_angle', 2e-4, 'rad', 0.0, 1.0,
             'Torsion of its teeth for an e-fold of torque.'),
    Property('flexspline.tooth_torque', 5.0, 'N m', 1e-9, BIG, 'From where teeth come to bear.'),
    Property('flexspline.error_amplitude', 2e-4, 'rad', 0.0, 1.0,
             'Twice a turn of the wave generator, seen from the load.'),
    Property('flexspline.static_torque', 0.02, 'N m', 0.0, BIG, 'Of the wave generator at rest, '
             'above sliding.'),
    Property('flexspline.static_speed', 5.0, 'rad/s', 1e-6, BIG, 'Of the motor: half is gone.'),
    Property('flexspline.mesh_coefficient', 0.1, '', 0.0, 10.0, 'Friction at the motor for one '
             'N m there, by the load of the teeth.'),
    Property('flexspline.turn_share', 0.15, '', 0.0, 1.0, 'Of the friction of the wave generator '
             'that swings twice a turn.'),
    Property('flexspline.creep_stiffness', 500.0, 'N m/rad', 0.0, BIG, 'That relaxes.'),
    Property('flexspline.creep_time', 0.3, 's', 1e-4, BIG, 'In which it relaxes.'),
    _scale('flexspline.stiffening', 'Teeth of the flexspline that bear one by one.'),
    _scale('flexspline.error', 'Kinematic error.'),
    _scale('flexspline.static', 'Static friction of the wave generator.'),
    _scale('flexspline.mesh_friction', 'Friction that the load of the teeth brings.'),
    _scale('flexspline.turn', 'Friction that swings with the wave generator.'),
    _scale('flexspline.creep', 'Creep of the flexspline.'),

    Property('coupling.mass', 0.0, 'kg', 0.0, BIG, 'Carried by the other axis.'),
    Property('coupling.reach', 0.2, 'm', -100.0, 100.0, 'Of it from this axis, other axis at 0.'),
    Property('coupling.offset', 0.0, 'm', -100.0, 100.0, 'Of it along this axis, then.'),
    Property('coupling.angle', 0.0, 'rad', -10.0, 10.0, 'Of the other axis, at the beginning.'),
    _scale('coupling.reaction', 'What turning inertias and rates push back.'),

    Property('motor.order', 24.0, '', 1.0, 1000.0, 'Cogging and ripple orders of the motor turn.'),
    Property('motor.cogging_torque', 0.006, 'N m', 0.0, BIG, 'Amplitude.'),
    _scale('motor.cogging', 'Detent torque of the magnets.'),
    _scale('motor.ripple', 'Torque that swings with the current; 1 is 0.6 %.'),

    Property('load.bandwidth', 60.0, 'Hz', 0.1, 1e3, 'Of the load simulator.'),
    _scale('load.lag', 'Slowness of the load simulator; 0 follows at once.'),
    _scale('load.ripple', 'Torque of the load simulator that swings; 1 is 0.5 %.'),

    Property('sensors.motor_counts', 10000.0, '', 1.0, 1e9, 'Counts a turn of the motor.'),
    Property('sensors.load_counts', 9216000.0, '', 1.0, 1e9, 'Counts a turn of the load.'),
    Property('sensors.motor_noise', 6e-5, 'rad', 0.0, 1.0, 'Jitter of the edges, one sigma.'),
    Property('sensors.load_noise', 4e-7, 'rad', 0.0, 1.0, 'Of the interpolation, one sigma.'),
    Property('sensors.torque_noise', 0.05, 'N m', 0.0, BIG, 'One sigma.'),
    Property('sensors.torque_wander', 0.01, 'N m/sqrt(s)', 0.0, BIG, 'Random walk of the zero.'),
    Property('sensors.torque_bandwidth', 1000.0, 'Hz', 1.0, 1e5, 'Of the torque sensor.'),
    Property('sensors.current_noise', 0.004, 'A', 0.0, BIG, 'One sigma.'),
    Property('sensors.temperature_noise', 0.05, 'degC', 0.0, BIG, 'One sigma.'),
    _scale('sensors.noise', 'Noise of all sensors.'),
    _scale('sensors.wander', 'Drift of the torque sensor.'),
    _scale('sensors.counts', 'Size of the encoder steps; 0 is continuous.'),
    _scale('sensors.lag', 'Slowness of the torque sensor.'),
    _scale('sensors.torque', '1: a torque sensor is fitted, 0: none.'),
    _scale('sensors.load_encoder', '1: an encoder sits on the load, 0: none.'),

    Property('bus.delay', 0.0, 's', 0.0, 0.1, 'Until the nodes answer a SYNC.'),
    Property('bus.jitter', 0.0, 's', 0.0, 0.1, 'Mean of what comes on top, exponential.'),

    Property('withheld.gravity', 0.0, 'N m', 0.0, BIG, 'Unbalance of the load, largest torque.'),
    Property('withheld.gravity_angle', 0.6, 'rad', -7.0, 7.0, 'Load angle at which it hangs.'),
    Property('withheld.spring_load', 0.0, 'N m/rad', 0.0, BIG, 'Spring at the load, softening.'),
    Property('withheld.quadratic_drag', 0.0, 'N m s^2/rad^2', 0.0, BIG, 'Fan on the load.'),
    Property('withheld.payload_inertia', 0.0, 'kg m^2', 0.0, BIG, 'Hung on the load elastically.'),
    Property('withheld.payload_frequency', 18.0, 'Hz', 0.1, 1e3, 'Of the payload, load held.'),
    Property('withheld.friction_drift', 0.0, '', -0.9, 10.0, 'Extra level at start that decays.'),
    Property('withheld.friction_drift_time', 15.0, 's', 0.1, 1e5, 'In which half has decayed.'),
    Property('withheld.local_spot', 0.0, 'N m', 0.0, BIG, 'Friction in a window of the turn.'),
    Property('withheld.local_spot_angle', 0.35, 'rad', -7.0, 7.0, 'Middle of the window.'),
    Property('withheld.local_spot_width', 0.12, 'rad', 1e-3, 7.0, 'Half width of the window.'),
    Property('withheld.rest_ageing', 0.0, 'N m', 0.0, BIG, 'Break-away after ten times the rest.'),
    Property('withheld.command_delay', 0.0, 's', 0.0, 0.01, 'Dead time of the command.'),
    Property('withheld.drive_dead_band', 0.0, 'V', 0.0, 10.0, 'Command without an answer.'),
    Property('withheld.drive_gain', 0.0, '', -0.9, 10.0, 'Relative error of K_a.'),
    Property('withheld.drive_offset', 0.0, 'V', -10.0, 10.0, 'Added to the command.'),
    Property('withheld.supply_sag', 0.0, 'ohm', 0.0, BIG, 'Inner resistance of the supply.'),
    Property('withheld.torque_constant', 0.0, '', -0.9, 10.0, 'Relative error.'),
    Property('withheld.torque_saturation', 0.0, '1/A', 0.0, 100.0, 'One over the knee current.'),
    Property('withheld.torque_ripple', 0.0, '', 0.0, 1.0, 'Relative, six times electrical.'),
    Property('withheld.cogging', 0.0, 'N m', 0.0, BIG, 'Detent torque at half the order.'),
    Property('withheld.motor_drag', 0.0, 'N m', 0.0, BIG, 'Dry friction at the motor.'),
    Property('withheld.load_drag', 0.0, 'N m', 0.0, BIG, 'Dry friction at the load.'),
    Property('withheld.load_sensor_delay', 0.0, 's', 0.0, 0.01, 'Of the load encoder.'),
    Property('withheld.load_eccentricity', 0.0, '', 0.0, 0.5, 'Of the load encoder, radius 1.'),
    Property('withheld.motor_eccentricity', 0.0, '', 0.0, 0.5, 'Of the motor encoder.'),
    Property('withheld.torque_sensor_gain', 0.0, '', -0.9, 10.0, 'Relative error.'),
    Property('withheld.torque_sensor_offset', 0.0, 'N m', -BIG, BIG, 'Added to the reading.'),
    Property('withheld.current_sensor_gain', 0.0, '', -0.9, 10.0, 'Of the reading, not the loop.'),
    Property('withheld.current_sensor_offset', 0.0, 'A', -BIG, BIG, 'Of the reading.'),
    Property('withheld.controller_gain', 0.0, '', -0.9, 10.0, 'Relative error of K_p.'),
    Property('withheld.controller_integral', 0.0, '', -0.9, 10.0, 'Relative error of K_i.'),
    Property('withheld.slosh', 0.0, 'kg m^2', 0.0, BIG, 'Liquid that lags, dragged by the load.'),
)

BY_PATH = {item.path: item for item in PROPERTIES}
