"""
Transfer function and state space of the pan-and-tilt, figures 6 and 7 of paper 004.

What `servo-twin linearise` makes of the servo file stands beside the paper's linear model, whose
equations are written out here with the same values, and beside the frequency response of the
emulated azimuth, which shares no law with either.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import control
import numpy as np

from servo_identify.experiment.procedures import Run
from servo_twin.description import servo_file
from servo_twin.description.shipped import servo_at
from servo_twin.linear.bode_plots import bode
from servo_twin.linear.frequency_response import estimate, extremes, Measured
from servo_twin.linear.operating_point import usual_point
from servo_twin.linear.state_space import LinearForm, linearise
from servo_twin.physics.fixed_inertia import with_fixed_inertia
from servo_twin.physics.harmonic_drive_models import with_harmonic_drive
from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

from .bench_recordings import Part, recorded
from .pan_tilt.pan_tilt_recordings import AZIMUTH, PERIOD
from .paper_systems import SYSTEMS

OUTPUT = 'load_speed'
BIAS, PEAK = 2.0, 2.0  # V: the azimuth always turns one way, as the linear form asks
ROUND, ROUNDS = 4.0, 9  # s in which the tones come round, how often; the first is left out
FIRST, LAST, TONES = 0.5, 80.0, 60  # Hz, Hz, how many at most


def make(work: Path, pictured: Path, told: Callable[[str, float], None]) -> dict:
    """Linearise, record, compare and draw; return the figures."""
    told('linearising', 0.0)
    servo = with_harmonic_drive(servo_file.load(servo_at(AZIMUTH)), None)
    form = linearise(servo, 'voltage', (OUTPUT,), usual_point(servo))
    told('recording the tones', 0.3)
    part = Part('tones', False, (tones(),), 100)
    recording, = recorded(work / 'linear_forms', None, (part,), AZIMUTH,
                          f'rigs/{AZIMUTH}.yaml')['tones']
    measured = response_of(recording)
    frequency = np.geomspace(FIRST, LAST, 600)
    (pictured / 'linear_pan_tilt.png').write_bytes(bode(form, OUTPUT, frequency, measured))
    return {'by_hand': beside_equations(form, servo), 'rig': beside_rig(form, measured)}


def turns() -> np.ndarray:
    """Return how often each tone turns in a round, evenly in the logarithm as far as that goes."""
    return np.unique(np.round(np.geomspace(FIRST * ROUND, LAST * ROUND, TONES)))


def tones(seed: int = 1) -> Run:
    """Return all tones at once on a constant voltage."""
    time = np.arange(round(ROUND * ROUNDS / PERIOD)) * PERIOD
    chance = np.random.default_rng(seed)
    wave = sum(np.sin(2.0 * np.pi * (n / ROUND * time + chance.random())) for n in turns())
    return Run('tones', 'multisine', 'voltage', PERIOD, BIAS + PEAK * wave / np.abs(wave).max(),
               np.zeros(len(time)))


def response_of(recording: Recording) -> Measured:
    """Return the response to the tones of the command, once the speed has settled."""
    late = round(ROUND / recording.period)
    settled = replace(recording, columns={n: c[late:] for n, c in recording.columns.items()})
    found = estimate(settled, 'voltage', OUTPUT, ROUND)
    tone = np.isin(np.round(found.frequency * ROUND), turns())  # others are its window's
    return replace(found, frequency=found.frequency[tone], response=found.response[tone],
                   coherence=found.coherence[tone])


def state_space(servo: Servo) -> control.StateSpace:
    r"""
    Return the paper's linear model from command (V) to speed of the load, in SI units.

    .. math:: L\,\dot i + R\,i + k_e\,\omega_m = k_p (K_a u - i), \quad
              J_m\dot\omega_m = k_t i - T/N - b_m\omega_m

    .. math:: J_l\dot\omega_l = T - b_l\omega_l, \quad
              T = K w + d\,\dot w, \quad \dot w = \omega_m/N - \omega_l

    The states are torsion w, speeds of motor and load, and the current. Paper 004 eq. 1 to 3 and
    sec. II E, friction as damping; the damping of the spring is that of eq. 4.
    """
    p = _values(servo)
    n = p['ratio']
    rate = np.array([0.0, 1.0 / n, -1.0, 0.0])
    torque = p['stiffness'] * np.array([1.0, 0.0, 0.0, 0.0]) + p['damping'] * rate
    motor = np.array([0.0, -p['motor_slope'], 0.0, p['torque_constant']]) - torque / n
    load = torque - np.array([0.0, 0.0, p['load_slope'], 0.0])
    volts = np.array([0.0, -p['back_emf'], 0.0, -p['resistance'] - p['proportional']])
    a = np.array([rate, motor / p['rotor_inertia'], load / p['load_inertia'],
                  volts / p['inductance']])
    b = [[0.0], [0.0], [0.0], [p['proportional'] * p['gain'] / p['inductance']]]
    return control.ss(a, b, [[0.0, 0.0, 1.0, 0.0]], 0.0)


def transfer_function(servo: Servo) -> tuple[np.poly1d, np.poly1d]:
    r"""
    Return numerator and denominator of the same model, the Laplace transform solved by hand.

    .. math:: \frac{\omega_l}{u} = \frac{k_t k_p K_a N P}
              {N^2 (W M + k_t k_e)(s D + P) + W D P}

    .. math:: W = L s + R + k_p, \quad M = J_m s + b_m, \quad D = J_l s + b_l, \quad P = d s + K
    """
    p = _values(servo)
    n, s = p['ratio'], np.poly1d([1.0, 0.0])
    winding = p['inductance'] * s + p['resistance'] + p['proportional']
    motor = p['rotor_inertia'] * s + p['motor_slope']
    load = p['load_inertia'] * s + p['load_slope']
    mesh = p['damping'] * s + p['stiffness']
    below = (n**2 * (winding * motor + p['torque_constant'] * p['back_emf']) * (s * load + mesh)
             + winding * load * mesh)
    return p['torque_constant'] * p['proportional'] * p['gain'] * n * mesh, below


def beside_equations(form: LinearForm, servo: Servo) -> dict[str, float]:
    """Return how far a linear form is from the equations: the largest relative differences."""
    above, below = transfer_function(servo)
    hand, found = state_space(servo), form.one(OUTPUT)
    apart = [np.abs(ours - theirs)[theirs != 0.0] / np.abs(theirs[theirs != 0.0])
             for ours, theirs in ((found.A, hand.A), (found.B, hand.B), (found.C, hand.C))]
    return {'poles': _apart([root.place for root in form.poles(OUTPUT)], below.roots),
            'zeros': _apart([root.place for root in form.zeros(OUTPUT)], above.roots),
            'gain': float(abs(form.transfer(OUTPUT)(0.0) / (above(0.0) / below(0.0)) - 1.0)),
            'matrices': float(max(differences.max() for differences in apart))}


def beside_rig(form: LinearForm, measured: Measured) -> dict:
    """Return how far a linear form is from a measured response, where that is coherent."""
    clear = measured.clear
    frequency = measured.frequency[clear]
    ratio = measured.response[clear] / form.response(OUTPUT, frequency, measured.period)
    size = np.abs(20.0 * np.log10(np.abs(ratio)))  # dB
    resonance, = (pole.frequency for pole in form.poles(OUTPUT) if pole.resonant)
    return {'tones': [int(clear.sum()), len(clear)],
            'band': [float(frequency[0]), float(frequency[-1])],
            'size': float(np.median(size)),
            'phase': float(np.median(np.abs(np.degrees(np.angle(ratio))))),
            'worst': float(size.max()), 'at': float(frequency[size.argmax()]),
            'resonance': [float(resonance), extremes(measured)[1]]}


def comparison_rows(found: Mapping) -> list[dict[str, str]]:
    """Return the row of docs/comparison.md."""
    name, = (system.name for system in SYSTEMS if system.part == 'linear_forms')
    hand, rig = found['by_hand'], found['rig']
    ours, theirs = rig['resonance']
    first, last = rig['band']
    clear, all_ = rig['tones']
    return [{'system': name, 'paper': '', 'command': '',
             'runs': 'both by `servo-twin linearise`, beside the equations by hand and the '
                     "emulated rig's frequency response",
             'ours': f'poles within {hand["poles"]:.1g} of the equations, gain '
                     f'{hand["gain"]:.1g}, matrices {hand["matrices"]:.1g}. Response within '
                     f'{rig["size"]:.2f} dB and {rig["phase"]:.1f} deg of the rig (median of '
                     f'the {clear} of {all_} tones that are coherent, {first:.2g} to {last:.2g} '
                     f'Hz), {rig["worst"]:.1f} dB at worst (at {rig["at"]:.0f} Hz); resonance '
                     f'{ours:.1f} Hz, rig {theirs:.1f}'}]


def _values(servo: Servo) -> dict[str, float]:
    """Return what stands in the equations, by the names of a servo whose other axis is level."""
    values = with_fixed_inertia(servo, 0.0).values
    named = {path.partition('.')[2]: value for path, value in values.items()
             if path.startswith(('drive.', 'mechanism.'))}
    return named | {f'{site}_slope': values[f'effects.{site}_viscous.slope']
                    for site in ('motor', 'load')}


def _apart(found: list[complex], wanted: np.ndarray) -> float:
    """Return the largest relative difference of roots; not a number where one is missing."""
    if len(found) != len(wanted):
        return float('nan')
    return float(np.abs(np.sort_complex(found) / np.sort_complex(wanted) - 1.0).max())
