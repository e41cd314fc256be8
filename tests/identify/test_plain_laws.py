"""Values and weights that explain all beside curves that nearly do; what a carried joint does."""

from dataclasses import replace

import numpy as np
import pytest
from test_clocks import AXIS, moved, PERIOD
from test_selection import named_by_equations, recorded, SERVO, with_effect

from servo_identify.diagnose.handover.hypothesis_effects import parts_of
from servo_identify.diagnose.handover.simulated_gap import simulated
from servo_identify.diagnose.residuals.samples import residual_samples
from servo_identify.diagnose.selection.choice import Choice
from servo_identify.diagnose.selection.explain import explained
from servo_twin.description import servo_file
from servo_twin.physics.catalogue import find
from servo_twin.physics.servo import Placed
from servo_twin.physics.simulate import initial_state, inputs_of, simulate
from servo_twin.recording.recording import COLUMNS, Recording

STAGE = servo_file.loads("""
servo: stage
travel: linear
step: 1.0e-3
drive: {type: current, gain: 1.0, torque_constant: 30.0}
mechanism: {type: rigid, rotor_inertia: 4.0, load_inertia: 0.0, ratio: 1.0}
sensors: {motor_encoder: {noise: 1.0e-7}, current_sensor: {noise: 0.01}}
effects:
  rubs: {effect: coulomb_friction, at: motor, level: 4.0}
  drags: {effect: viscous_friction, at: motor, slope: 8.0}
tolerance: {drive.torque_constant: 2 %, mechanism.rotor_inertia: 2 %}
""")
ARM = servo_file.loads("""
servo: arm
step: 1.0e-3
drive: {type: current, gain: 1.0, torque_constant: 1.0}
mechanism: {type: rigid, rotor_inertia: 0.01, load_inertia: 0.036, ratio: 1.0}
sensors: {motor_encoder: {noise: 2.0e-4}, voltage_sensor: {noise: 0.003}}
effects:
  rubs: {effect: coulomb_friction, at: load, level: 0.15}
  drags: {effect: viscous_friction, at: load, slope: 0.1}
  weight: {effect: gravity, at: load, cosine: -1.5, sine: 0.1}
tolerance: {mechanism.load_inertia: 5 %, effects.weight.cosine: 5 %, effects.rubs.level: 20 %}
""")


def driven(rig, seed, command, tick=2e-3, **beside):
    """Return a rig under a command (samples,); ``beside`` are columns that act on it."""
    time, chance = tick * np.arange(len(command)), np.random.default_rng(seed)
    columns = {name: np.full(len(time), np.nan) for name in COLUMNS} | {
        'voltage': command} | beside
    y = simulate(rig, inputs_of(columns), tick, initial_state(rig, 0.0, 0.0), 'measured_input')
    noise = {name: chance.normal(0.0, rig.noise(name), len(time))
             for name in ('motor_position', 'current') if rig.noise(name) > 0.0}
    seen = {'motor_position': y[:, 0] + noise['motor_position'], 'voltage': command}
    if 'current' in noise:
        seen['current'] = y[:, 3] + noise['current']
    kept = {name: beside[name] for name in ('coupled_position',) if name in beside}
    whole = {name: np.full(len(time), np.nan) for name in COLUMNS}
    return Recording(f'run {seed}', tick, whole | seen | kept, family='run', replicate=seed,
                     digest=f'{seed:064d}')


def sines(seed, size, seconds=16.0, tick=2e-3, tones=(0.4, 0.9, 1.7, 3.1)):
    time, chance = np.arange(0.0, seconds, tick), np.random.default_rng(100 + seed)
    phase = chance.uniform(0.0, 2.0 * np.pi, len(tones))
    return size * np.sin(2.0 * np.pi * time[:, None] * np.array(tones) + phase).mean(axis=1)


def test_a_force_constant_is_no_ratio_where_all_is_at_the_motor():
    """A value that scales a balance would close any gap in it."""
    weaker = STAGE.with_values({'drive.torque_constant': 26.0})
    several = [driven(weaker, seed, sines(seed, 6.0)) for seed in (1, 2)]
    assert named_by_equations(several, STAGE) == {('torque_constant_error', 'motor')}


@pytest.mark.long
@pytest.mark.slow
def test_a_payload_is_its_weight_and_its_inertia_and_no_drive_that_is_weaker():
    """Held by a loop, an arm with more to carry answers as if its drive were weaker."""
    loaded = ARM.with_values({'effects.weight.cosine': -2.7, 'effects.weight.sine': 0.3,
                              'mechanism.load_inertia': 0.055})

    def held(seed):
        angle, speed, asked, tick = 0.0, 0.0, sines(seed, 1.2), 2e-3
        command, chance = np.zeros(len(asked)), np.random.default_rng(seed)
        numbers = loaded.numbers
        inertia = numbers['mechanism.load_inertia'] + numbers['mechanism.rotor_inertia']
        seen = np.zeros(len(asked))
        for k, target in enumerate(asked):  # an oracle of its own: no twin runs in a loop here
            command[k] = 25.0 * (target - angle) - 0.8 * speed
            for _ in range(4):
                resists = 0.15 * np.tanh(speed / 1e-3) + 0.1 * speed
                weight = -2.7 * np.cos(angle) + 0.3 * np.sin(angle)
                speed += 0.25 * tick * (command[k] + weight - resists) / inertia
                angle += 0.25 * tick * speed
            seen[k] = angle
        columns = {name: np.full(len(asked), np.nan) for name in COLUMNS}
        seen = np.concatenate(([0.0], seen[:-1]))
        return Recording(f'held {seed}', tick, columns | {
            'voltage': command + chance.normal(0.0, 0.003, len(asked)),
            'motor_position': seen + chance.normal(0.0, 2e-4, len(asked))}, family='held',
            replicate=seed, digest=f'{seed:064d}')

    named = {name for name, _ in named_by_equations([held(seed) for seed in (1, 2, 3)], ARM)}
    assert {'gravity', 'parameter:load_inertia'} <= named and 'parameter:gain' not in named


@pytest.mark.long
def test_a_carried_joint_changes_the_inertia_and_its_own_motion_is_felt():
    time = np.arange(0.0, 16.0, 2e-3)

    def with_elbow(seed):
        elbow = 1.2 * np.sin(2.0 * np.pi * 0.31 * time + seed) + 0.3 * seed
        rate = np.gradient(elbow, time)
        felt = np.gradient((0.14 + 0.125 * np.cos(elbow)) * rate, time)
        arm = base.with_effects(Placed('e', find('coupled_inertia'), 'load'), values={
            'effects.e.cosine': 0.25, 'effects.e.sine': 0.0, 'effects.e.order': 1.0,
            'effects.e.level': 0.0})
        return driven(arm, seed, sines(seed, 14.0), coupled_position=elbow, external_torque=-felt)

    base = ARM.with_values({'mechanism.load_inertia': 0.53, 'effects.weight.cosine': 0.0,
                            'effects.weight.sine': 0.0})
    plain = replace(base.with_values({'mechanism.load_inertia': 0.9}), tolerance={})
    assert named_by_equations([with_elbow(seed) for seed in (1, 2, 3)], plain) == {
        ('parameter:load_inertia', 'load'), ('external_torque', 'load')}


@pytest.mark.long
def test_an_eccentric_disc_beside_another_ratio_is_both_and_no_wave_of_many_orders():
    several = []
    for seed in (1, 2):
        one = moved(seed)
        load = one.columns['load_position'] * 20.0 / 20.05
        load = load + 6e-4 * np.sin(load - 0.9) + 2e-4 * np.sin(2.0 * load + 0.3)
        several.append(Recording(one.name, PERIOD, {**one.columns, 'load_position': load},
                                 family='moved', replicate=seed, digest=one.digest))
    assert named_by_equations(several, AXIS) == {
        ('parameter:ratio', 'mesh'), ('load_encoder_eccentricity', 'load_position')}


@pytest.mark.long
def test_a_weight_beside_a_spring_is_both_and_no_curve_over_the_angle():
    rig = ARM.with_effects(Placed('s', find('spring_load'), 'load'), values={
        'effects.s.stiffness': 0.9, 'effects.s.rest': -0.3, 'effects.weight.cosine': 0.2,
        'effects.weight.sine': 0.7})
    bare = replace(ARM.with_values({'effects.weight.cosine': 0.0, 'effects.weight.sine': 0.0}),
                   tolerance={'mechanism.load_inertia': (0.034, 0.038)})
    several = [driven(rig, seed, sines(seed, 5.0)) for seed in (1, 2, 3)]
    weights = ('parameter:weight.cosine', 'gravity')
    assert named_by_equations(several, bare) in [
        {(weight, 'load'), ('spring_load', 'load')} for weight in weights]


@pytest.mark.long
def test_a_swing_of_two_seconds_is_a_payload_that_swings():
    rig = STAGE.with_effects(Placed('e', find('payload_resonance'), 'load'), values={
        'effects.e.inertia': 0.6, 'effects.e.frequency': 0.45, 'effects.e.damping': 0.02})
    several = [driven(rig, seed, sines(seed, 6.0, seconds=24.0, tones=(0.2, 0.5, 0.9)))
               for seed in (1, 2)]
    assert named_by_equations(several, STAGE) == {('payload_resonance', 'load')}


def test_a_twin_that_drifts_throws_no_load_by_a_torsion_that_encoders_contradict():
    heavy = AXIS.with_values({'effects.rubs.level': 0.8})  # of the twin; the rig rubs less
    gap = simulated(heavy, [moved(5)]).gap
    assert gap.rms('torsion') < 10.0 * gap.floor['torsion']  # 216 with a start that is free


@pytest.mark.long
@pytest.mark.slow
def test_a_hose_that_stiffens_is_a_spring_though_waves_of_a_weight_follow_it_as_well():
    angles = np.linspace(-0.3, 0.3, 16)
    rig = with_effect('torque_over_angle', 'load', low=-0.3, high=0.3,
                      curve=tuple(-3.0 * np.sinh(angles / 0.08)))
    found = explained(residual_samples([recorded(rig, seed) for seed in (1, 2)], SERVO))
    assert [one.mechanism.name for one in found.chosen] == ['spring_load']
    weight = next(n for n, one in enumerate(found.hypotheses)
                  if one.mechanism.name == 'gravity' and len(one.knots) == 6)
    fit = found.search.fitted(Choice(()).plus(weight, 0))
    as_weight = replace(found, explanation=replace(found.explanation, smallest=fit))
    (part,) = parts_of(as_weight, weight, np.tile(as_weight.amplitudes(weight), (9, 1)), ())
    assert (part.mechanism.name, part.mechanism.site) == ('spring_load', 'load')
