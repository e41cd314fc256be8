"""One contract for every effect of the catalogue."""

from __future__ import annotations

import inspect
import re

import every_effect
from every_effect import parameters
from hypothesis import given, settings
from hypothesis import strategies as st
import numba
import numpy as np
import pytest

from servo_twin.physics.catalogue import find, names
from servo_twin.physics.effect import Effect
from servo_twin.physics.kernel import kernel_of
from servo_twin.physics.ports import PORTS
from servo_twin.physics.simulate import initial_state, simulate

EFFECTS = [find(name) for name in names()]
PLACES = [(placed.effect, placed.site) for placed in every_effect.PLACED]
each_effect = pytest.mark.parametrize('effect', EFFECTS, ids=lambda e: e.name)
each_place = pytest.mark.parametrize(
    ('effect', 'site'), PLACES, ids=[placed.name for placed in every_effect.PLACED])

SIGNED = """
supply_sag eddy_brake
coulomb_friction viscous_friction stribeck_friction presliding_friction asymmetric_friction
load_dependent_friction position_dependent_friction quadratic_drag friction_drift cogging
torque_ripple torque_saturation current_sensor_offset current_sensor_gain gravity spring_load
current_lag command_delay drive_dead_band drive_saturation nonlinear_stiffness backlash
load_dependent_backlash position_dependent_backlash hysteresis transmission_error
load_encoder_eccentricity sensor_delay torque_sensor_gain torque_sensor_offset payload_resonance
relaxing_spring command_rate_limit torque_speed_limit braking_power_limit sensor_lag
viscoelasticity torque_sensor_inertia
""".split()
"""The effects among the table of signatures of GAP_METHOD.md; the rest of it are parameters."""

BASE = ('torque', 'angle', 'time', 'current', 'voltage', 'temperature', 'length')
DIMENSIONS = {
    '': {}, 'N m': {'torque': 1}, 'rad': {'angle': 1}, 's': {'time': 1}, 'm': {'length': 1},
    'A': {'current': 1}, 'V': {'voltage': 1},
    'ohm': {'voltage': 1, 'current': -1}, 'Hz': {'time': -1}, 'degC': {'temperature': 1}, '1': {},
    'kg m2': {'torque': 1, 'time': 2, 'angle': -1},
}
MOTION_UNITS = {
    'angle': 'rad', 'motor_angle': 'rad', 'load_angle': 'rad', 'travel': 'rad', 'speed': 'rad/s',
    'rate': 'rad/s', 'torque': 'N m', 'current': 'A', 'temperature': 'degC', 'time': 's',
    'direction': '', 'reference': 'rad', 'coupled_angle': 'rad', 'driven': 'rad',
}
ANSWER_UNITS = {
    'friction': 'N m', 'torque': 'N m', 'mesh': 'N m', 'mesh_error': 'rad', 'clearance': 'rad',
    'inertia': 'kg m2',
}
SITE_UNITS = {
    'command': 'V', 'motor_position': 'rad', 'load_position': 'rad', 'torque': 'N m',
    'current': 'A',
}


def dimension(unit: str) -> dict[str, int]:
    """Return the exponents of a unit such as ``N m s2/rad2``; KeyError where it is none."""
    above, *below = unit.split('/')
    powers = dict.fromkeys(BASE, 0)
    for part, sign in ((above, 1), (' '.join(below), -1)):
        for token, times in re.findall(r'(N m|kg m2|1|[^\s\d]+)(\d*)', part):
            for base, power in DIMENSIONS[token].items():
                powers[base] += sign * power * int(times or 1)
    return powers


def scale(unit: str, factors: dict[str, float]) -> float:
    """Return what a number of this unit is multiplied with when the base units change."""
    total = 1.0
    for base, power in dimension(unit).items():
        total *= factors[base] ** power
    return total


def rescaled(effect: type[Effect], factors: dict[str, float]):
    """Return an effect's parameters at their defaults, in other base units."""
    return parameters(effect, **{
        name: np.multiply(p.default, scale(p.unit, factors))
        for name, p in effect.parameters.items()})


def motions(effect: type[Effect], seed: int, samples: int = 40) -> list[dict[str, float]]:
    """Return a random walk of what the port of an effect shows, rows of names to values."""
    noise = np.random.default_rng(seed)
    speed = np.cumsum(noise.normal(0.0, 0.3, samples))
    angle = noise.uniform(-3.0, 3.0) + np.cumsum(speed) * 1e-2
    torque = np.cumsum(noise.normal(0.0, 30.0, samples))
    walk = {
        'angle': angle, 'load_angle': angle, 'motor_angle': 161.0 * angle, 'driven': angle,
        'speed': speed, 'rate': speed, 'torque': torque, 'travel': np.abs(angle - angle[0]),
        'current': torque / 10.0, 'value': torque / 10.0, 'time': np.arange(samples) * 1e-2,
        'temperature': 20.0 + np.cumsum(noise.normal(0.0, 1.0, samples)),
        'direction': np.where(speed > 0.0, 1.0, -1.0), 'reference': 1.01 * angle,
        'coupled_angle': angle,
    }
    if effect.port == 'mesh':
        walk['angle'] = angle * 1e-3
    return [{f: float(walk[f][k]) for f in effect.motion._fields} for k in range(samples)]


def answers(law, effect: type[Effect], p, rows, h: float, site: str = '',
            factors: dict[str, float] | None = None) -> np.ndarray:
    """Return what a law says along a motion, rescaled, from a memory of zero."""
    factors = factors or dict.fromkeys(BASE, 1.0)
    units = {**MOTION_UNITS, 'value': SITE_UNITS.get(site, '')}
    rates = {field: scale(units[field], factors) for field in effect.motion._fields}
    memory = np.zeros(effect.memory)
    return np.array([
        law(p, memory, effect.motion(**{f: v * rates[f] for f, v in row.items()}),
            h * factors['time']) for row in rows])


# --- declaration


def test_the_effects_that_a_diagnosis_may_propose_are_those_of_the_table_of_signatures():
    assert {effect.name for effect in EFFECTS if effect.candidate} == set(SIGNED)


@each_effect
def test_an_effect_declares_itself_completely(effect):
    text = inspect.getdoc(effect)
    assert '.. math::' in text, 'no equation'
    assert text.splitlines()[0].endswith('.'), 'no first sentence'
    assert inspect.getmodule(effect).__doc__.strip().endswith('.')
    assert effect.source
    assert effect.port in PORTS and effect.sites
    assert effect.__bases__ == (PORTS[effect.port],), 'an effect is a port made final'
    assert inspect.getmodule(effect).__name__.rpartition('.')[2] == effect.name
    assert effect.parameters and effect.amplitudes(), 'nothing in it can vanish'


@each_effect
def test_a_parameter_declares_itself_completely(effect):
    for name, parameter in effect.parameters.items():
        assert parameter.meaning.endswith('.'), name
        dimension(parameter.unit)
        held = parameter.default if parameter.row else (parameter.default,)
        off = () if parameter.off is None else (parameter.off,)
        for value in (*held, *parameter.grid, *off):
            assert parameter.refuse(value) is None, f'{name} = {value}'
        low, high = parameter.bounds
        assert low < high and np.isfinite([low, high]).all(), name
        assert not (parameter.grid and parameter.off is not None), f'{name}: a grid is for shapes'
    assert any(p.default != p.off and p.default != (p.off,) for p in effect.parameters.values()
               if p.off is not None), 'its defaults are those of no effect'


# --- units


@each_place
@settings(max_examples=8, deadline=None)
@given(powers=st.lists(st.integers(-3, 3), min_size=len(BASE), max_size=len(BASE)),
       seed=st.integers(0, 2**16))
def test_a_law_rescales_with_its_declared_units(effect, site, powers, seed):
    factors = {base: 2.0**power for base, power in zip(BASE, powers, strict=True)}
    rows = motions(effect, seed)
    factor = scale(ANSWER_UNITS.get(effect.port) or SITE_UNITS[site], factors)
    plain = answers(effect.law, effect, parameters(effect), rows, 1e-2, site)
    scaled = answers(effect.law, effect, rescaled(effect, factors), rows, 1e-2, site, factors)
    assert np.isfinite(plain).all()
    np.testing.assert_allclose(scaled / factor, plain, rtol=1e-9, atol=1e-12 * np.abs(plain).max())


# --- compiled and off


@pytest.mark.long
@each_effect
def test_a_compiled_law_says_what_the_plain_law_says(effect):
    kernel = kernel_of(every_effect.servo())
    index = next(i for i, p in enumerate(every_effect.PLACED) if p.effect is effect)
    law = getattr(kernel.module, f'law{index}')
    compiled = numba.njit(lambda p, s, motion, h: law(p, s, motion, h), error_model='numpy')
    values = getattr(kernel.module, f'Values{index}')
    p = values(*parameters(effect))
    for seed in range(5):
        rows = motions(effect, seed)
        np.testing.assert_allclose(answers(compiled, effect, p, rows, 1e-3),
                                   answers(effect.law, effect, p, rows, 1e-3), rtol=1e-12)


@pytest.fixture(scope='module')
def moving():
    """Inputs that reverse the servo, stop it and wind it up, and the ideal answer to them."""
    t = np.arange(150) * 1e-3
    u = every_effect.inputs(len(t), voltage=4.0 * np.sin(60.0 * t) + 2.0 * np.sin(200.0 * t),
                            temperature=20.0 + 100.0 * t, coupled_position=5.0 * t)
    return u, run(every_effect.servo(), u, every_effect.only())


def run(servo, u, on):
    return simulate(servo, u, 1e-3, initial_state(servo, 5.0, 0.0, 20.0, on=on), on=on)


@pytest.mark.parametrize('placed', every_effect.PLACED, ids=lambda p: p.name)
def test_an_effect_at_its_off_values_is_switched_off_to_the_last_bit(placed, moving):
    u, ideal = moving
    vanished = every_effect.servo(every_effect.off([placed]))
    assert np.array_equal(run(vanished, u, every_effect.only(placed.name)), ideal)


@pytest.mark.parametrize('placed', every_effect.PLACED, ids=lambda p: p.name)
def test_an_effect_at_its_defaults_changes_what_the_sensors_read(placed, moving):
    u, ideal = moving
    low = {'effects.drive_saturation_at_command.limit': 2.0,  # V, the command reaches 6
           'effects.braking_power_limit_at_command.power': 2.0}  # V rad/s, it brakes little
    y = run(every_effect.servo(low), u, every_effect.only(placed.name))
    assert np.isfinite(y).all()
    assert not np.array_equal(y, ideal)


# --- energy


def closed_cycle(effect: type[Effect], seed: int, **changes):
    """Return (torque that the law gives, speed, step) over one cycle after a first one."""
    steps, h, noise = 4000, 1e-3, np.random.default_rng(seed)
    t = np.arange(2 * steps) * h
    angle = np.zeros_like(t)
    for order in (1, 2, 3):
        a, phase = noise.normal(0.0, 0.5), noise.uniform(0.0, 6.3)
        angle += a * np.sin(2.0 * np.pi * order * t / (steps * h) + phase)
    if effect.port == 'mesh':
        angle *= 1e-3
    speed = np.diff(angle, append=angle[0]) / h
    speed[-1] = speed[steps - 1]
    way, turned, rows = 1.0, angle[0], []
    for k in range(len(t)):
        if speed[k] * way < 0.0:
            way, turned = -way, angle[k]
        middle = angle[k] + 0.5 * h * speed[k]
        seen = {'angle': middle, 'load_angle': middle, 'speed': speed[k], 'rate': speed[k],
                'direction': way, 'torque': 50.0 * np.sin(3.0 * middle), 'time': 0.0,
                'travel': abs(angle[k] - turned), 'current': 1.0, 'temperature': 20.0}
        rows.append({f: seen[f] for f in effect.motion._fields})
    torque = answers(effect.law, effect, parameters(effect, **changes), rows, h)
    if effect.port == 'friction':
        torque = -np.maximum(torque, 0.0) * np.array([row['direction'] for row in rows])
    if effect.port == 'mesh':
        torque = -torque  # on the motor, that winds up
    return torque[steps:], speed[steps:], h


DISSIPATING = [e for e in EFFECTS if e.port == 'friction' or e.name in (
    'presliding_friction', 'dahl_friction', 'hysteresis', 'dahl_hysteresis',
    'wind_up_damping', 'dissipative_hysteresis', 'viscoelasticity')]
CONSERVATIVE = [find(name) for name in ('gravity', 'spring_load', 'cogging',
                                        'nonlinear_stiffness', 'stiffening_spring')]


@pytest.mark.parametrize('effect', DISSIPATING, ids=lambda e: e.name)
@pytest.mark.parametrize('seed', range(3))
def test_friction_never_drives(effect, seed):
    torque, speed, h = closed_cycle(effect, seed)
    work = h * torque @ speed
    assert work <= 0.0
    if effect.port == 'friction':
        assert (torque * speed <= 0.0).all()
    elif effect.port == 'torque':
        assert work < -0.1 * h * np.abs(torque) @ np.abs(speed)


@pytest.mark.parametrize('effect', CONSERVATIVE, ids=lambda e: e.name)
def test_a_conservative_torque_does_no_work_over_a_closed_cycle(effect):
    torque, speed, h = closed_cycle(effect, 1)
    assert abs(h * torque @ speed) < 2e-3 * h * np.abs(torque) @ np.abs(speed)
