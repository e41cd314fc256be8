"""What differs over time beside a machine: clocks that run apart, oil that warms."""

import numpy as np
import pytest
from test_selection import named_by_equations

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.selection.explain import explained
from servo_twin.description import servo_file
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS, Recording

AXIS = servo_file.loads("""
servo: axis
step: 1.0e-4
drive: {type: current, gain: 1.0, torque_constant: 0.1}
mechanism: {type: two_inertia, rotor_inertia: 1.0e-4, load_inertia: 0.05, ratio: 20.0,
            stiffness: 2000.0, damping: 2.0}
sensors: {motor_encoder: {noise: 1.0e-4}, load_encoder: {noise: 2.0e-5},
          current_sensor: {noise: 0.02}}
effects:
  rubs: {effect: coulomb_friction, at: load, level: 0.5}
  drags: {effect: viscous_friction, at: load, slope: 0.2}
""")
PERIOD, SECONDS = 1e-3, 20.0


def moved(seed, apart=0.0, late=0.0, drag=0.2):
    """Return an axis in motion; the clock of its load encoder runs ``apart`` (s a second)."""
    rig = AXIS.with_values({'effects.drags.slope': drag})
    time = np.arange(0.0, SECONDS, PERIOD)
    chance = np.random.default_rng(seed)
    phase = chance.uniform(0.0, 2.0 * np.pi, 4)
    tones = np.array((0.3, 0.8, 1.9, 4.3))
    command = 3.0 * np.sin(2.0 * np.pi * time[:, None] * tones + phase).mean(axis=1)
    columns = {name: np.full(len(time), np.nan) for name in COLUMNS}
    columns['voltage'] = command
    y = simulate(rig, inputs_of(columns), PERIOD, initial_state(rig, 0.0, 0.0),
                 'measured_input')
    load = np.interp(time - late - apart * time, time, y[:, 1])
    seen = {'voltage': command,
            'motor_position': y[:, 0] + chance.normal(0.0, 1e-4, len(time)),
            'load_position': load + chance.normal(0.0, 2e-5, len(time)),
            'current': y[:, 3] + chance.normal(0.0, 0.02, len(time))}
    return Recording(f'moved {seed}', PERIOD, columns | seen, family='moved', replicate=seed,
                     digest=f'{seed:064d}')


@pytest.mark.long
def test_a_clock_that_runs_apart_is_no_delay_and_none_is_seen_where_none_is():
    assert named_by_equations([moved(seed) for seed in (1, 2)], AXIS) == set()
    apart = [moved(seed, apart=2e-4) for seed in (1, 2)]
    assert named_by_equations(apart, AXIS) == {('clock_drift', 'load_position')}
    late = [moved(seed, late=4e-3) for seed in (1, 2)]
    assert named_by_equations(late, AXIS) == {('sensor_delay', 'load_position')}


@pytest.mark.long
@pytest.mark.slow
def test_the_answer_says_how_far_a_clock_runs_apart_and_what_to_do():
    several = [moved(seed, apart=3e-4, late=1e-3) for seed in (1, 2, 3)]
    answer = diagnose(several[:1], AXIS, several[1:2], several[2:])
    assert [one.effect for one in answer.report.which] == ['clock_drift']
    sentence = answer.report.verdict['sentence']
    assert 'ms late at the start, and 0.3' in sentence
    assert 'Bring the load_position to the time of the other channels' in sentence


@pytest.mark.long
def test_friction_whose_rise_with_speed_differs_by_recording_is_told_by_it():
    """Oil that warms from one recording to the next; the level of friction stays."""
    several = [moved(seed, drag=drag) for seed, drag in enumerate((0.9, 0.6, 0.4))]
    one, = explained(residual_samples(several, AXIS)).chosen
    assert (one.mechanism.name, one.mechanism.site) == ('friction_drift', 'load')
    assert one.mechanism.variables == ('recording', 'speed')
