"""The residual balances: it ..."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from servo_twin.balances.residual_filters import Balances, channel_residuals
from servo_twin.description import servo_file
from servo_twin.lockstep.twin import Twin
from servo_twin.physics.servo import Servo
from servo_twin.physics.state import OUTPUTS
from servo_twin.recording.joined_samples import CHANNELS, samples_of
from servo_twin.recording.recording import BALANCES, COLUMNS

PERIOD = 1e-3
SIZE = 2000
TIME = np.arange(SIZE) * PERIOD
SENSORS = {
    'motor_encoder': '{noise: 1.8e-4}', 'load_encoder': '{noise: 2.0e-6}',
    'torque_sensor': '{noise: 0.1}', 'current_sensor': '{noise: 0.005}',
    'voltage_sensor': '{noise: 0.001}',
}


def two_inertia(stiffness: float = 5e5) -> str:
    """Return the mechanism of the bench."""
    return ('{type: two_inertia, rotor_inertia: 1.14e-4, load_inertia: 5.76, ratio: 161.0, '
            f'stiffness: {stiffness}, damping: 40.0}}')


def current(gain: float = 0.49) -> str:
    """Return the drive of the bench."""
    return f'{{type: current, gain: {gain}, torque_constant: 0.4878}}'


def servo(without: tuple[str, ...] = (), drive: str = current(), effects: str = '{}',
          mechanism: str = two_inertia(), controller: str = '{type: none}') -> Servo:
    """Return a bench without some of its sensors."""
    sensors = ', '.join(f'{k}: {v}' for k, v in SENSORS.items() if k not in without)
    return servo_file.loads(f'{{servo: bench, drive: {drive}, mechanism: {mechanism}, '
                            f'controller: {controller}, sensors: {{{sensors}}}, '
                            f'effects: {effects}}}')


def measured(of: Servo, mode: str = 'measured_input', **columns: object) -> np.ndarray:
    """Return what a rig that is exactly `of` measures under a sine command and `columns`."""
    given_ = {name: np.full(SIZE, np.nan) for name in COLUMNS}
    given_['voltage'] = 2.0 * np.sin(8.0 * TIME)
    given_ |= {name: np.broadcast_to(value, SIZE) for name, value in columns.items()}
    y = Twin(of, PERIOD, mode, catch=0.0).step(0, samples_of(given_))
    return samples_of(given_ | dict(zip(OUTPUTS, y.T, strict=True)))


def residual(of: Servo, samples: np.ndarray, **keywords: object) -> dict[str, np.ndarray]:
    """Return the balances of a rig's samples against the twin `of`, in units of each balance."""
    y = Twin(of, PERIOD, catch=0.0).step(0, samples)
    balances = Balances(of, PERIOD, **keywords)
    return dict(zip(BALANCES, (balances.whole(samples, y) * balances.noise).T, strict=True))


def rms(values: np.ndarray) -> float:
    """Return the RMS of what is not NaN."""
    return float(np.sqrt(np.nanmean(values**2)))


def test_it_is_zero_when_the_rig_is_the_twin():
    of = servo(effects='{a: {effect: coulomb_friction, at: load, level: 20.0}}')
    found = residual(of, measured(of))
    for name in ('drive', 'motor', 'transmission', 'load', 'sensor'):
        assert np.nanmax(np.abs(found[name])) == 0.0, name
    assert np.isnan(found['controller']).all() and np.isnan(found['torque_balance']).all()


@pytest.mark.long
@pytest.mark.parametrize('effect, site, value, balance', [
    ('coulomb_friction', 'load', 'level: 20.0', 'load'),
    ('coulomb_friction', 'motor', 'level: 0.05', 'motor'),
])
def test_it_reads_a_friction_back_in_its_balance_and_nowhere_else(effect, site, value, balance):
    rig = servo(effects=f'{{a: {{effect: {effect}, at: {site}, {value}}}}}')
    of = servo()
    found, noise = residual(of, measured(rig)), Balances(of, PERIOD).noise
    level = float(value.split()[-1])
    assert np.nanmedian(np.abs(found[balance])) == pytest.approx(level, rel=0.02)
    for name in ('drive', 'motor', 'transmission', 'load', 'sensor'):
        if name != balance:
            assert rms(found[name]) < 3.0 * noise[BALANCES.index(name)], name


def test_it_reads_a_torque_on_the_load_back_with_its_course():
    push = 30.0 * np.sin(10.0 * TIME)
    of = servo()
    samples = measured(of, external_torque=push)
    samples[:, CHANNELS.index('external_torque')] = np.nan  # the rig does not say so
    found = residual(of, samples)['load']
    assert found[50:-50] == pytest.approx(push[50:-50], abs=0.4)


def test_it_reads_a_stiffness_back_in_the_transmission():
    soft = servo(mechanism=two_inertia(2.5e5))
    samples = measured(soft)
    found = residual(servo(), samples)
    torque = samples[:, CHANNELS.index('torque')]
    expected = torque * (1 / 2.5e5 - 1 / 5e5)
    assert np.corrcoef(found['transmission'][50:-50], expected[50:-50])[0, 1] > 0.99
    assert rms(found['load']) < 3.0 * Balances(servo(), PERIOD).noise[BALANCES.index('load')]


def test_it_reads_a_gain_error_back_in_the_drive():
    rig = servo(drive=current(0.6))
    found = residual(servo(), measured(rig))
    expected = 0.11 * 2.0 * np.sin(8.0 * (TIME - PERIOD))
    assert found['drive'][50:-50] == pytest.approx(expected[50:-50], abs=2e-3)
    assert rms(found['motor']) < 1e-3 and rms(found['load']) < 0.1


def test_it_reads_a_resistance_back_as_voltage_of_the_winding():
    winding = ('{{type: voltage, resistance: {}, back_emf: 0.02, inductance: 0.001, '
               'torque_constant: 0.1}}')
    rig, of = servo(drive=winding.format(1.5)), servo(drive=winding.format(1.0))
    samples = measured(rig)
    found = residual(of, samples)['drive']
    expected = 0.5 * samples[:, CHANNELS.index('current')]
    assert rms(found[50:-50] - expected[50:-50]) < 0.03 * rms(expected)


@pytest.mark.long
def test_it_joins_motor_and_load_without_a_torque_sensor():
    effects = '{a: {effect: coulomb_friction, at: load, level: 20.0}}'
    of = servo(without=('torque_sensor',))
    found = residual(of, measured(servo(effects=effects)))
    assert np.nanmedian(np.abs(found['torque_balance'])) == pytest.approx(20.0, rel=0.02)
    assert np.isnan(found['motor']).all() and np.isnan(found['load']).all()


@pytest.mark.long
@pytest.mark.slow
def test_it_needs_only_one_encoder_and_the_command_for_the_torque_balance():
    lacks = ('torque_sensor', 'current_sensor', 'load_encoder')
    rigid = '{type: rigid, rotor_inertia: 1.14e-4, load_inertia: 5.76, ratio: 161.0}'
    friction = servo(effects='{a: {effect: coulomb_friction, at: load, level: 20.0}}',
                     mechanism=rigid)
    of = servo(without=lacks, mechanism=rigid)
    found = residual(of, measured(friction))
    assert np.nanmedian(np.abs(found['torque_balance'])) == pytest.approx(20.0, rel=0.02)
    for name in ('drive', 'motor', 'load', 'transmission', 'sensor'):
        assert np.isnan(found[name]).all(), name


LOOP = '{{type: velocity_pi, kp: {}, ki: 505.38}}'


@pytest.mark.long
@pytest.mark.slow
def test_it_finds_the_controller_clean_when_only_the_plant_differs():
    rig = servo(controller=LOOP.format(16.09),
                effects='{a: {effect: coulomb_friction, at: load, level: 20.0}}')
    samples = measured(rig, 'closed_loop', reference_velocity=0.3 * np.sin(3.0 * TIME))
    found = residual(servo(controller=LOOP.format(16.09)), samples)
    assert rms(found['controller']) < 1e-9


def test_it_reads_a_gain_of_the_controller_back():
    rig = servo(controller=LOOP.format(20.0))
    reference = 0.3 * np.sin(30.0 * TIME)
    samples = measured(rig, 'closed_loop', reference_velocity=reference)
    of = servo(controller=LOOP.format(16.09))
    found = residual(of, samples)['controller']
    load = samples[:, CHANNELS.index('motor_position')] / 161.0
    error = reference - np.gradient(load, PERIOD)
    assert found[200:-50] == pytest.approx(3.91 * error[200:-50], abs=0.05)
    noise = Balances(of, PERIOD).noise[BALANCES.index('controller')]
    assert rms(found) > 100.0 * noise


def test_it_says_nothing_of_a_controller_whose_loop_is_open():
    of = servo(controller=LOOP.format(16.09))
    assert np.isnan(residual(of, measured(of))['controller']).all()


def test_it_gives_one_where_there_is_only_noise():
    of = servo(controller=LOOP.format(16.09))
    clean = measured(of, 'closed_loop', reference_velocity=0.3 * np.sin(3.0 * TIME))
    y = Twin(of, PERIOD, catch=0.0).step(0, clean)
    random, noisy, squares = np.random.default_rng(5), clean.copy(), []
    for _ in range(8):
        for name in OUTPUTS:
            column = CHANNELS.index(name)
            noisy[:, column] = clean[:, column] + of.noise(name) * random.normal(size=SIZE)
        squares.append(np.nanmean(Balances(of, PERIOD).whole(noisy, y) ** 2, axis=0))
    levels = np.sqrt(np.mean(squares, axis=0))
    for name, level in zip(BALANCES[:-1], levels, strict=False):
        assert level == pytest.approx(1.0, abs=0.15), name


@settings(max_examples=40)
@given(st.lists(st.integers(1, 60), min_size=1, max_size=10),
       st.sets(st.integers(1, 399), max_size=3), st.floats(0.0, 0.1))
def test_it_gives_the_same_bits_however_samples_are_cut(sizes, breaks, window):
    of = servo(controller=LOOP.format(16.09))
    random = np.random.default_rng(3)
    samples, y = random.normal(size=(400, len(CHANNELS))), random.normal(size=(400, len(OUTPUTS)))
    samples[100, CHANNELS.index('torque')] = np.nan
    whole = Balances(of, PERIOD, window).whole(samples, y, sorted(breaks))
    cuts = [0, *(c for c in np.cumsum(sizes * 40).tolist() if c < 400), 400]
    balances, pieces = Balances(of, PERIOD, window), []
    for start, end in zip(cuts, cuts[1:], strict=False):
        within = sorted(b - start for b in breaks if start <= b < end)
        pieces.append(balances.push(samples[start:end], y[start:end], within))
    pieces.append(balances.finish())
    assert np.array_equal(np.vstack(pieces), whole, equal_nan=True)
    assert len(whole) == 400


def test_it_is_nan_beside_a_break_and_at_both_ends():
    of, size = servo(), 200
    balances = Balances(of, PERIOD, 0.02)
    assert balances.half == 10
    found = balances.whole(np.ones((size, len(CHANNELS))), np.zeros((size, len(OUTPUTS))), (90,))
    good = np.isfinite(found[:, BALANCES.index('load')])
    assert good.tolist() == [10 <= k < 80 or 100 <= k < 190 for k in range(size)]


def test_it_subtracts_the_twin_from_the_rig_in_each_channel():
    samples, y = np.arange(10.0)[None, :], np.array([[1.0, 2.0, 3.0, 4.0, 5.0]])
    assert channel_residuals(samples, y).tolist() == [[2.0, 2.0, 2.0, -2.0]]
