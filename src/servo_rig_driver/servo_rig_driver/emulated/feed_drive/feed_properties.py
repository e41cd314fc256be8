"""
Everything that the emulated feed drive can be told: one line a property, as in ..properties.

A property of kind "scale" turns one effect: 0 off, 1 as the machine is, 2 twice as strong. Values
without a source are assumed, of catalogues for a machine of this size; paper 001 gives table 2.
"""

from __future__ import annotations

from ..rig_properties import BIG, Property


def _scale(path: str, meaning: str) -> Property:
    return Property(path, 1.0, '', 0.0, 100.0, meaning)


PROPERTIES = (
    # what every rig has, whatever its physics
    Property('machine.ratio', 392.69908, 'rad/m', 0.01, 1e6, 'Motor angle for one metre: 16 mm.'),
    Property('machine.torque_constant', 1.0182, 'N m/A', 1e-6, 100.0, '18 N m at 12.5 A rms.'),
    Property('machine.rotor_inertia', 5.3e-3, 'kg m^2', 1e-9, 1e3, 'Motor shaft (table 2).'),
    Property('machine.coupling_inertia', 4.2e-4, 'kg m^2', 1e-9, 1e3, 'Half of it on the screw.'),
    Property('machine.screw_inertia', 1.8e-3, 'kg m^2', 1e-9, 1e3, 'Shared by three nodes.'),
    Property('machine.screw_mass', 8.3, 'kg', 1e-3, 1e4, 'What the bearings hold along.'),
    Property('machine.table_mass', 222.0, 'kg', 1e-3, 1e6, 'Table and what lies on it.'),

    Property('drive.current_loop', 1.0, '', 0.0, 1.0, 'Always 1: the drive takes currents too.'),
    Property('drive.command_gain', 20.943951, 'rad/s/V', 1e-3, 1e5, '2000 rpm at 10 V.'),
    Property('drive.command_limit', 10.0, 'V', 1e-3, 1e3, 'The command never exceeds this.'),
    Property('drive.current_limit', 53.0, 'A', 1e-3, 1e4, 'Three times the nominal current.'),
    Property('drive.bus_voltage', 556.0, 'V', 1.0, 1e4, 'That feeds the inverter.'),
    Property('drive.pole_pairs', 4.0, '', 1.0, 100.0, 'Table 2.'),
    Property('drive.resistance', 0.195, 'ohm', 1e-4, 1e3, 'Of a phase, and its leads, warm.'),
    Property('drive.inductance', 2.27e-3, 'H', 1e-7, 10.0, 'Of a phase.'),
    Property('drive.current_cycle', 31.25e-6, 's', 1e-6, 1e-3, 'Table 2.'),
    Property('drive.velocity_every', 4.0, '', 1.0, 1000.0, 'Runs of the current loop: 125 us.'),
    Property('drive.current_gain', 11.5, 'V/A', 0.0, 1e4, 'Table 2: 5000 Hz times 2.3 mH.'),
    Property('drive.current_time', 9.8e-3, 's', 1e-6, 1e3, 'Table 2.'),
    Property('drive.velocity_gain', 4.1642, 'A s/rad', 0.0, 1e5, 'Table 2: 800 Hz, of the rotor.'),
    Property('drive.velocity_time', 0.04, 's', 1e-6, 1e3, 'Table 2.'),
    Property('drive.velocity_filter', 1.6e-4, 's', 0.0, 1.0, 'Of the measured speed.'),
    Property('drive.position_gain', 120.0, '1/s', 0.0, 1e4, 'Table 2, 120 Hz.'),
    Property('drive.latency', 42e-6, 's', 0.0, 1e-3, 'Age of the angle the control gets.'),
    Property('drive.dead_time', 3.5e-7, 's', 0.0, 1e-5, 'Of the switches, what is not made good.'),
    Property('drive.sensor_gain', 0.006, '', -0.5, 0.5, 'By how much phase b reads more than a.'),
    Property('drive.emf_harmonics', 0.012, '', 0.0, 1.0, 'Fifth and seventh, of the back EMF.'),
    Property('drive.cogging_torque', 0.05, 'N m', 0.0, BIG, 'Detent torque of 36 slots.'),
    Property('drive.cogging_order', 36.0, '', 1.0, 1000.0, 'Of the motor turn.'),
    _scale('drive.imperfection', 'Dead time, sensors, harmonics and cogging together.'),

    Property('screw.coupling_stiffness', 1.55e4, 'N m/rad', 1.0, BIG, 'Of the coupling.'),
    Property('screw.torsion', 1.32e4, 'N m^2/rad', 1.0, BIG, 'G J of the screw.'),
    Property('screw.stretch', 2.1e8, 'N', 1.0, BIG, 'E A of the screw.'),
    Property('screw.bearing', 1.5e9, 'N/m', 1.0, BIG, 'Both bearings along.'),
    Property('screw.damping', 0.02, '', 0.0, 1.0, 'Of coupling, torsion, bearings; critical 1.'),
    Property('screw.span', 0.9, 'm', 0.01, 100.0, 'Between the bearings.'),
    Property('screw.place', 0.45, 'm', 0.0, 100.0, 'Of the nut when the scale reads 0.'),
    Property('screw.pitch_slope', 1.1e-5, '', -1e-2, 1e-2, 'Error of the pitch over the travel.'),
    Property('screw.pitch_wave', 2.4e-6, 'm', 0.0, 1e-3, 'Error that comes and goes.'),
    Property('screw.pitch_length', 0.27, 'm', 1e-3, 10.0, 'In which it does.'),
    Property('screw.wobble', 3.5e-7, 'm', 0.0, 1e-3, 'Error of every turn.'),
    _scale('screw.pitch', 'All errors of the pitch.'),
    Property('screw.expansion', 1.15e-5, '1/K', 0.0, 1e-3, 'Of steel; off at 0.'),

    Property('nut.play', 1.5e-5, 'm', 0.0, 1e-2, 'Of the flanks; what bends makes it 17 um.'),
    Property('nut.hertz', 2.0e11, 'N/m^1.5', 1.0, 1e15, 'Balls: force over press to the 3/2.'),
    Property('nut.damping', 60.0, 's/m', 0.0, 1e5, 'Share of the force for 1 m/s of pressing.'),
    Property('nut.drag', 0.17, 'N m', 0.0, BIG, 'Of preloaded balls and seals.'),
    Property('nut.loss', 0.045, '', 0.0, 1.0, 'Friction as a share of the force that it drives.'),
    Property('nut.bearing_drag', 0.16, 'N m', 0.0, BIG, 'Of motor and bearings.'),
    Property('nut.viscous', 4.5e-3, 'N m s/rad', 0.0, BIG, 'Grease of all that turns.'),

    Property('ways.dry', 118.0, 'N', 0.0, BIG, 'Wipers and rollers, warm and sliding.'),
    Property('ways.viscous', 640.0, 'N s/m', 0.0, BIG, 'Grease, cold and slow.'),
    Property('ways.thinning', 0.35, 'm/s', 1e-4, 1e3, 'Speed that thins it (Eyring).'),
    Property('ways.reach', 9e-6, 'm', 1e-8, 1e-2, 'Travel in which contacts slip.'),
    Property('ways.fade', 2.5e-3, 'm/s', 1e-6, 10.0, 'Where the ways weaken with speed.'),
    _scale('ways.weakening', 'Fall of the friction with the logarithm of speed.'),
    _scale('ways.place', 'Variation along the travel; 1 is some 15 %.'),
    _scale('ways.temperature', 'Fall with warmth; 1 is 0.8 % a kelvin.'),
    _scale('ways.friction', 'All dry friction of the ways.'),

    Property('thermal.capacity', 3900.0, 'J/K', 1e-3, BIG, 'Of the screw.'),
    Property('thermal.cooling', 4.0, 'W/K', 1e-6, BIG, 'To the room.'),
    Property('thermal.room', 20.0, 'degC', -50.0, 100.0, 'At which the pitch is right.'),
    Property('thermal.start', 20.5, 'degC', -50.0, 150.0, 'Screw and ways at the beginning.'),
    _scale('thermal.heating', 'Heat of friction that goes into the screw.'),

    Property('load.lag', 0.004, 's', 0.0, 1.0, 'In which a cutting force builds up.'),

    Property('sensors.motor_counts', 1048576.0, '', 1.0, 1e9, 'Counts a turn of the motor.'),
    Property('sensors.load_step', 5e-8, 'm', 1e-12, 1e-3, 'Of the linear scale.'),
    Property('sensors.load_noise', 5e-8, 'm', 0.0, 1.0, 'Of the scale, one sigma.'),
    Property('sensors.load_cyclic', 8e-8, 'm', 0.0, 1.0, 'Error within a line of 20 um.'),
    Property('sensors.current_noise', 0.04, 'A', 0.0, BIG, 'One sigma.'),
    Property('sensors.temperature_noise', 0.05, 'degC', 0.0, BIG, 'One sigma.'),
    _scale('sensors.noise', 'Noise of all sensors.'),
    _scale('sensors.counts', 'Size of the steps of encoder and scale; 0 is continuous.'),
    _scale('sensors.load_encoder', '1: a scale is on the table, 0: none.'),

    Property('bus.delay', 0.0, 's', 0.0, 0.1, 'Until the nodes answer a SYNC.'),
    Property('bus.jitter', 0.0, 's', 0.0, 0.1, 'Mean of what comes on top, exponential.'),
)
