"""A motor alone with its drive: what a bridge loses, limits and follows late."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_recordings import sampled
from test_selection import named_by_equations

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.selection.explain import explained
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed

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


def moved(rig, seed, lost=0.0, row=ROW, size=1.2, softly=0.0, trembles=0.0, measured=True):
    """
    Return a recording of a motor; at 100 Hz it answers within a row.

    By the sign of its current volts are ``lost``, A ``softly``. The command ``trembles`` by some
    V; the current is ``measured`` or not.
    """
    time = np.arange(round(15.0 / row)) * row
    command = sum(size * np.sin(2.0 * np.pi * f * time + seed + 3.0 * f) for f in (0.3, 1.1, 2.7))
    command = command + trembles * np.random.default_rng(seed).standard_normal(len(time))
    one = sampled(rig, command, seed=seed, period=row)
    gone = np.full(len(time), np.nan)
    current = one.columns['current']
    sign = np.tanh(current / softly) if softly else np.sign(current)
    return replace(one, columns={**one.columns, 'load_position': gone, 'torque': gone,
                                 'voltage': command + lost * sign,
                                 'current': current if measured else gone},
                   family='multisine', name=f'multisine_{seed}')


@pytest.mark.long
@pytest.mark.slow
def test_a_motor_that_answers_within_a_row_is_not_blamed_for_it():
    assert named_by_equations([moved(HOBBY, seed) for seed in (1, 2)], HOBBY) == set()


@pytest.mark.long
@pytest.mark.slow
def test_a_supply_that_sags_is_no_saturation():
    lost = {'drop': 0.03, 'resistance': HOBBY.numbers['drive.resistance'],
            'back_emf': HOBBY.numbers['drive.back_emf']}
    rig = HOBBY.with_effects(Placed('sag', find('supply_sag'), 'command'), values={
        f'effects.sag.{name}': value for name, value in lost.items()})
    several = [moved(rig, seed, row=1e-3, size=4.0) for seed in (1, 2)]
    found = explained(residual_samples(several, HOBBY))
    assert [one.mechanism.name for one in found.chosen] == ['supply_sag']
    drop, = found.amplitudes(found.explanation.smallest.choice.numbers[0])
    assert drop == pytest.approx(0.03, rel=0.1)


@pytest.mark.long
@pytest.mark.slow
def test_a_battery_that_also_sags_slowly_is_one_sag():
    lost = {'drop': 0.02, 'slow': 0.05, 'settling': 0.15,
            'resistance': HOBBY.numbers['drive.resistance'],
            'back_emf': HOBBY.numbers['drive.back_emf']}
    rig = HOBBY.with_effects(Placed('sag', find('supply_sag'), 'command'), values={
        f'effects.sag.{name}': value for name, value in lost.items()})
    several = [moved(rig, seed, row=1e-3, size=4.0) for seed in (1, 2)]
    found = explained(residual_samples(several, HOBBY))
    (number,) = found.explanation.smallest.choice.numbers
    assert found.hypotheses[number].mechanism.name == 'supply_sag'
    assert found.hypotheses[number].knots[0] == pytest.approx(0.15, rel=0.3)
    assert found.amplitudes(number) == pytest.approx([0.02, 0.05], rel=0.2)


@pytest.mark.long
@pytest.mark.slow
def test_volts_that_a_bridge_loses_by_the_sign_of_its_current_are_a_dead_band():
    several = [moved(HOBBY, seed, lost=0.4, row=1e-3) for seed in (1, 2, 3)]
    answer = diagnose(several[:1], HOBBY, several[1:2], several[2:])
    assert [one.effect for one in answer.report.which] == ['drive_dead_band']
    lost = {path.partition('.')[2]: value for path, value in answer.augmented.numbers.items()}
    if 'drive_dead_time.loss' in lost:  # here the current has the sign of the command
        lost['drive_dead_band.half_width'] = 3.2 * lost['drive_dead_time.loss']
    widths = [lost[name] for name in ('drive_dead_band.half_width', 'uneven_dead_band.positive',
                                      'uneven_dead_band.negative') if name in lost]
    assert widths and widths == pytest.approx([0.4] * len(widths), rel=0.1)


@pytest.mark.long
@pytest.mark.slow
def test_volts_that_are_lost_softly_are_found_beside_cogging():
    rig = HOBBY.with_values({'drive.inductance': 1.6e-3}).with_effects(
        Placed('detents', find('cogging'), 'motor'), values={
            'effects.detents.order': 12.0, 'effects.detents.cosine': (0.04,),
            'effects.detents.sine': (0.0,)})
    believed = HOBBY.with_values({'drive.inductance': 1.6e-3})
    several = [moved(rig, seed, lost=0.5, row=1e-3, size=2.5, softly=0.1) for seed in (1, 2, 3)]
    answer = diagnose(several[:1], believed, several[1:2], several[2:])
    assert {one.effect for one in answer.report.which} == {'drive_dead_band', 'cogging'}
    numbers = answer.augmented.numbers
    assert 3.2 * numbers['effects.drive_dead_time.loss'] == pytest.approx(0.5, rel=0.25)
    assert answer.report.gap['solved'] > 0.6


@pytest.mark.slow
def test_a_dead_band_is_found_beside_a_weight_under_a_command_that_trembles():
    """An encoder of counts has its controller tremble, and no motion shows how."""
    rig = HOBBY.with_effects(
        Placed('band', find('drive_dead_band'), 'command'), Placed('arm', find('gravity'), 'load'),
        values={'effects.band.half_width': 0.6, 'effects.band.regain': 1e6,
                'effects.arm.cosine': 0.05, 'effects.arm.sine': -0.2})
    several = [moved(rig, seed, row=2e-3, size=1.5, trembles=0.5, measured=False)
               for seed in (1, 2)]
    assert named_by_equations(several, HOBBY) == {
        ('drive_dead_band', 'command'), ('gravity', 'load')}


@pytest.mark.long
def test_a_chopper_that_limits_the_current_saturates_the_drive():
    limited = HOBBY.with_effects(Placed('e', find('current_limit'), 'current'),
                                 values={'effects.e.limit': 0.25})
    several = [moved(limited, seed, row=2e-3, size=4.0) for seed in (1, 2, 3)]
    answer = diagnose(several[:1], HOBBY, several[1:2], several[2:])
    first = answer.report.which[0]
    assert (first.effect, first.site, first.law) == ('drive_saturation', 'current', True)
    assert answer.augmented.numbers['effects.current_limit.limit'] == pytest.approx(0.25, rel=0.05)


@pytest.mark.long
@pytest.mark.slow
def test_a_command_that_is_followed_no_faster_than_a_limit_is_a_limit_of_its_rate():
    limited = HOBBY.with_effects(Placed('e', find('command_rate_limit'), 'command'),
                                 values={'effects.e.rate': 12.0})
    several = [moved(limited, seed, row=2e-3) for seed in (1, 2, 3)]
    answer = diagnose(several[:1], HOBBY, several[1:2], several[2:])
    assert [one.effect for one in answer.report.which] == ['command_rate_limit']
    low, high = answer.report.which[0].interval
    assert low - 1e-9 <= answer.report.which[0].shrink_realised <= high + 1e-9
    assert answer.augmented.numbers['effects.command_rate_limit.rate'] == pytest.approx(
        12.0, rel=0.05)
