"""What machines that had no part in building the diagnosis asked of it."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_recordings import sampled
from test_selection import named_by_equations, recorded, SERVO, with_effect

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.selection.explain import explained
from servo_identify.diagnose.splitting import split
from servo_twin.description import servo_file
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS, Recording

HOBBY = servo_file.loads("""
servo: hobby
step: 1.0e-4
drive: {type: voltage, resistance: 3.2, inductance: 0.0, back_emf: 0.3, torque_constant: 0.3}
mechanism: {type: rigid, rotor_inertia: 1.0e-4, load_inertia: 0.0, ratio: 1.0}
sensors:
  motor_encoder: {noise: 1.0e-3}
  current_sensor: {noise: 2.0e-3}
effects:
  rubs: {effect: coulomb_friction, at: motor, level: 0.05}
""")
ROW = 0.01  # s, and J R / (K_m K_e) is 3.6 ms


def moved(rig, seed, lost=0.0, row=ROW):
    """Return a recording of a motor; at 100 Hz it answers within a row."""
    time = np.arange(round(15.0 / row)) * row
    command = sum(1.2 * np.sin(2.0 * np.pi * f * time + seed + 3.0 * f) for f in (0.3, 1.1, 2.7))
    one = sampled(rig, command, seed=seed, period=row)
    gone = np.full(len(time), np.nan)
    return replace(one, columns={**one.columns, 'load_position': gone, 'torque': gone,
                                 'voltage': command + lost * np.sign(one.columns['current'])},
                   family='multisine', name=f'multisine_{seed}')


@pytest.mark.slow
def test_a_motor_that_answers_within_a_row_is_not_blamed_for_it():
    assert named_by_equations([moved(HOBBY, seed) for seed in (1, 2)], HOBBY) == set()


@pytest.mark.slow
def test_volts_that_a_bridge_loses_by_the_sign_of_its_current_are_a_dead_band():
    several = [moved(HOBBY, seed, lost=0.4, row=1e-3) for seed in (1, 2, 3)]
    answer = diagnose(several[:1], HOBBY, several[1:2], several[2:])
    assert [one.effect for one in answer.report.which] == ['drive_dead_band']
    numbers = answer.augmented.numbers  # here the current has the sign of the command
    lost = numbers.get('effects.drive_dead_band.half_width') or (
        3.2 * numbers['effects.drive_dead_time.loss'])
    assert lost == pytest.approx(0.4, rel=0.1)


@pytest.mark.slow
def test_an_error_over_the_motors_turn_may_leave_the_motor_alone():
    ratio = SERVO.numbers['mechanism.ratio']  # an effect of the load's turn does not act back
    rig = with_effect('transmission_error', 'mesh', order=2.0 * ratio, cosine=(2e-4,),
                      sine=(1e-4,))
    assert named_by_equations([recorded(rig, seed) for seed in (1, 2)]) == {
        ('transmission_error', 'mesh')}


@pytest.mark.slow
def test_a_clearance_that_takes_the_load_up_over_a_little_is_a_clearance():
    rig = with_effect('load_dependent_backlash', 'mesh', growth=4e-4, load=2.0)
    several = [recorded(rig, seed) for seed in (1, 2, 3)]
    report = diagnose(several[:1], SERVO, several[1:2], several[2:]).report
    assert report.which[0].effect == 'backlash'


@pytest.mark.slow
def test_a_lag_of_second_order_is_no_delay():
    lag = with_effect('current_lag', 'current', lag=0.012)
    twice = lag.with_effects(replace(lag.effects[-1], name='e2'), values={'effects.e2.lag': 0.012})
    found = explained(residual_samples([recorded(twice, seed) for seed in (1, 2)], SERVO))
    assert {one.mechanism.name for one in found.chosen} == {'current_lag'}


def test_a_motion_that_no_other_recording_repeats_is_not_held_out():
    def one(family, replicate):
        return Recording(f'{family}_{replicate}', 1e-3, {'voltage': np.zeros(10)}, family=family,
                         replicate=replicate, digest=f'{family}{replicate}')

    parts = split([one('chirp', 1), one('squat', 1), one('squat', 2), one('swing', 1),
                   one('swing', 2)], [], [])
    assert [r.name for r in parts.screen] == ['chirp_1', 'squat_1', 'swing_1']
    assert {r.name for r in (*parts.accept, *parts.report)} == {'squat_2', 'swing_2'}


KNEE = servo_file.loads("""
servo: knee
step: 1.0e-4
drive: {type: current, gain: 1.0, torque_constant: 0.091}
mechanism: {type: rigid, rotor_inertia: 6.1e-5, load_inertia: 0.048, ratio: 9.0}
controller: {type: impedance, kp: 60.0, kd: 1.2, kf: 1.0, command_torque: 0.819, filter: 0.001,
             torque_limit: 30.0, on_load: 0.0}
sensors:
  motor_encoder: {noise: 1.0e-4}
  current_sensor: {noise: 0.02}
effects:
  rubs: {effect: coulomb_friction, at: load, level: 0.35}
  drags: {effect: viscous_friction, at: load, slope: 0.02}
""")
WITHIN = 20  # turns of the drive's own loop to a row


def told(seed):
    """Return rows of a drive whose own loop is faster, its current read as a row's target came."""
    fine = np.arange(100_000) * 1e-4
    rows = fine[::WITHIN]
    place, rate = (sum(0.3 * factor(f) * wave(2.0 * np.pi * f * rows + seed) for f in (0.4, 1.3))
                   for factor, wave in ((lambda f: 1.0, np.sin),
                                        (lambda f: 2.0 * np.pi * f, np.cos)))
    columns = {name: np.full(len(fine), np.nan) for name in COLUMNS}
    columns['reference_position'] = np.repeat(place, WITHIN)
    columns['reference_velocity'] = np.repeat(rate, WITHIN)
    y = simulate(KNEE, inputs_of(columns), 1e-4,
                 initial_state(KNEE, 9.0 * place[0], place[0], load_speed=rate[0]), 'closed_loop')
    chance = np.random.default_rng(seed)
    seen = {name: np.full(len(rows), np.nan) for name in COLUMNS}
    seen |= {'reference_position': place, 'reference_velocity': rate,
             'motor_position': y[::WITHIN, 0] + 1e-4 * chance.standard_normal(len(rows)),
             'current': y[1::WITHIN, 3] + 0.02 * chance.standard_normal(len(rows))}
    return Recording(f'swing {seed}', 1e-4 * WITHIN, seen, family='swing', digest=f'{seed:064d}')


@pytest.mark.slow
def test_a_current_read_as_a_target_came_is_no_friction():
    assert named_by_equations([told(seed) for seed in (1, 2)], KNEE) == set()
