"""
A motor bench with a flexible coupling: its resonances by output error and by frequency response.

The frequency response is model free: spectra over whole periods of the multisine, acceleration of
the motor over the current reference; a parabola through the three lines about an extreme of its
logarithm places it between the lines.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from servo_identify.data.table_import import import_table
from servo_identify.fit.estimate import Estimate
from servo_identify.fit.output_error import fit
from servo_twin.description import servo_file
from servo_twin.description.shipped import shipped
from servo_twin.physics.catalogue import find
from servo_twin.physics.mechanisms.two_inertia import TwoInertia
from servo_twin.physics.servo import Placed, Servo
from servo_twin.recording.recording import Recording

PERIOD = 1.0  # s, of the multisine
FREE = ('mechanism.rotor_inertia', 'mechanism.load_inertia', 'mechanism.stiffness',
        'mechanism.damping', 'effects.viscous.slope', 'effects.coulomb.level', 'effects.loop.lag')


def recording_of(data: Path) -> Recording:
    """Return the recording of the shared data folder."""
    return import_table(data / 'two_mass/MultisineTypeA.mat', shipped('servos/two_mass.yaml'),
                        mapping=shipped('imports/two_mass.yaml'))


def compliant() -> Servo:
    """
    Return the servo of the bench with its coupling and the lag of its current loop.

    The shipped file takes the coupling as rigid and the loop as perfect.
    """
    rigid = servo_file.load(shipped('servos/two_mass.yaml'))
    values = {**rigid.values, 'mechanism.stiffness': 100.0, 'mechanism.damping': 0.02}
    soft = replace(rigid, mechanism=TwoInertia, values=values, tolerance={}, step=1e-4)
    return soft.with_effects(Placed('loop', find('current_lag'), 'current'),
                             values={'effects.loop.lag': 5e-4})


def fitted(recording: Recording) -> Estimate:
    """
    Fit the compliant servo; delays are estimated, as the drive and the bus have some.

    Whitened: the slow drift of a bench that no position loop holds would drown its resonance.
    """
    return fit(compliant(), [recording], FREE, horizon=1.0, delays=True, weights='whitened',
               channels=('motor_position', 'load_position'))


def resonances(servo: Servo) -> tuple[float, float]:
    """Return antiresonance (of the motor) and resonance of a servo, Hz."""
    value = servo.values
    stiffness, load, ratio = (value[f'mechanism.{n}'] for n in (
        'stiffness', 'load_inertia', 'ratio'))
    rotor = value['mechanism.rotor_inertia'] * ratio**2
    return (float(np.sqrt(stiffness / load) / (2.0 * np.pi)),
            float(np.sqrt(stiffness * (1.0 / load + 1.0 / rotor)) / (2.0 * np.pi)))


def response(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Return the excited frequencies, Hz, and motor acceleration over the command there."""
    length = round(PERIOD / recording.period)
    count = len(recording) // length

    def spectra(signal: np.ndarray) -> np.ndarray:
        whole = signal[len(signal) - count * length:].reshape(count, length)
        return np.fft.rfft(whole - whole.mean(axis=1, keepdims=True), axis=1)[1:].mean(axis=0)

    command = spectra(recording['voltage'])
    speed = spectra(np.gradient(recording['motor_position'], recording.period))
    frequency = np.fft.rfftfreq(length, recording.period)
    excited = np.abs(command) > 0.02 * np.abs(command).max()
    ratio = 2j * np.pi * frequency[excited] * speed[excited] / command[excited]
    return frequency[excited], ratio


def measured_resonances(recording: Recording) -> tuple[float, float]:
    """Return antiresonance and resonance of the measured frequency response, Hz."""
    frequency, ratio = response(recording)
    size = np.log(np.abs(ratio))
    top = int(np.argmax(size))
    low = int(np.argmin(np.where(frequency < frequency[top], size, np.inf)))
    return _extreme(frequency, size, low), _extreme(frequency, size, top)


def _extreme(frequency: np.ndarray, size: np.ndarray, at: int) -> float:
    a, b, c = size[at - 1:at + 2]
    return float(frequency[at] + 0.5 * (a - c) / (a - 2.0 * b + c)
                 * (frequency[at + 1] - frequency[at]))


def figures(data: Path) -> dict:
    """Return the resonances of the fit beside those of the frequency response, Hz."""
    recording = recording_of(data)
    estimate = fitted(recording)
    return {'fitted': resonances(estimate.servo), 'measured': measured_resonances(recording),
            'values': dict(estimate.values), 'std': dict(estimate.std),
            'delays': dict(estimate.delays)}
