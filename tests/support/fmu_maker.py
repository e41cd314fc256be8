"""The example FMU and a servo of it for tests, which are skipped without a C compiler."""

from pathlib import Path
from shutil import which

import pytest

from servo_twin.description import servo_file
from servo_twin.fmu import example_fmu

SERVO = """
servo: screw
step: {step}
drive: {{type: voltage, gain: 2.0, resistance: 1.5, inductance: 1.0e-3, back_emf: 0.1,
         torque_constant: 0.1}}
mechanism:
{mechanism}
  ratio: 20.0
  rotor_inertia: 1.0e-3
  load_inertia: 0.5
controller: {{type: velocity_pi, kp: 1.0, ki: 10.0, limit: 20.0}}
sensors: {{motor_encoder: {{noise: 1.0e-5}}, load_encoder: {{noise: 1.0e-5}},
          torque_sensor: {{noise: 0.01}}, current_sensor: {{noise: 1.0e-3}}}}
effects:
  late: {{effect: current_lag, at: current, lag: 5.0e-4}}
  dry: {{effect: coulomb_friction, at: load, level: 0.6}}
  rub: {{effect: coulomb_friction, at: motor, level: 0.02}}
  spring: {{effect: spring_load, at: load, stiffness: 10.0}}
  net: {{effect: network_residual, at: motor, current: [1.0, -0.5], speed: [0.01, 0.02],
        threshold: [0.1, 0.0], weight: [0.02, 0.03], level: 0.01}}
  read: {{effect: current_sensor_gain, at: current, excess: 0.02}}
{more}
"""
OUTPUTS = '{motor_angle: phi_m, motor_speed: w_m, load_angle: phi_l, load_speed: w_l, torque: tau}'
INPUT = '{motor_torque: tau_m, external_torque: tau_ext}'
START = '{motor_angle: phi_m0, motor_speed: w_m0, load_angle: phi_l0, load_speed: w_l0}'
PARAMETERS = '{ratio: ratio, rotor_inertia: J_m, load_inertia: J_l, stiffness: c, fails: fail_at}'


def made(folder: Path, version: int = 2, **said) -> Path:
    """Return a new FMU, see servo_twin.fmu.example_fmu."""
    if not which(example_fmu.COMPILER):
        pytest.skip('there is no C compiler')
    return example_fmu.made(folder, version, **said)


def mapped(fmu, inputs=INPUT, outputs=OUTPUTS, start=START, parameters=PARAMETERS, more=''):
    """Return the section of an FMU."""
    return (f'  type: fmu\n  file: {fmu}\n  inputs: {inputs}\n  outputs: {outputs}\n'
            f'  start: {start}\n  parameters: {parameters}\n{more}')


def servo_of(mechanism, step=1e-4, more='', folder='.'):
    """Return a servo with that mechanism."""
    text = SERVO.format(mechanism=mechanism, step=step, more=more)
    return servo_file.loads(text, 'made', folder)
