r"""
What a change of each place adds to the equations of a servo.

The equations are taken along what the rig measured, with the filters of the balances
(:mod:`servo_twin.balances.equations`). No twin runs beside: one that runs freely comes to other
speeds after a change, and every balance of it then sees the error of its neighbour.

=============== ==================================================================================
drive           :math:`K_v u - R i - L\,di/dt - k_e\omega_m`, or :math:`i - K_a u`
motor           :math:`K_m i - J_m\dot\omega_m - T/N`, what is left is friction of the motor
load            :math:`T - J_l\dot\omega_l - T_e`, what is left is friction of the load
torque_balance  N times motor plus load, where T is not measured
transmission    :math:`\theta_m/N - \theta_l - T/K`
ripple          the logarithm of the mean of :math:`|T - \bar T|`, with the smoothed torque
=============== ==================================================================================

A part that changes enters its own equation: more friction of the load adds
:math:`\mathrm{sgn}\,\omega` to ``load``, another torque constant adds :math:`i` to ``motor``. An
error :math:`e` of a reading enters each equation that the reading is in: an error of the torque
adds :math:`e` to ``load`` and :math:`-e/N` to ``motor``. So parts and sensors differ. A reading
that sticks has no noise; only one that repeats itself is tried as stuck.

Errors of the teeth :math:`e(\theta_m)` enter three equations. The motor feels
:math:`T\,(1/N - e')`, as no power is lost in the teeth; where they shake the torque, the mean of
:math:`T e'` resists the motor as friction does. The ``ripple`` tells them from friction, which
makes none: teeth with errors as steep as STEEPEST drag no more than that share of the ripple.
"""

from __future__ import annotations

import numpy as np

from servo_twin.balances.equations import balance_taps
from servo_twin.balances.residual_filters import half_of, WINDOW
from servo_twin.physics.servo import Servo
from servo_twin.physics.state import OUTPUTS
from servo_twin.recording.joined_samples import CHANNELS
from servo_twin.recording.recording import BALANCES

from ..estimator.equation_samples import biweight
from .change_candidates import Candidate, OF_A_SHAFT

RIPPLE = 'ripple'
STEEPEST = 0.1  # of the ratio: N e', by which teeth with errors turn the load faster or slower
NAMES = ('drive', 'motor', 'transmission', 'load', 'torque_balance')
MOTOR, LOAD, TORQUE, CURRENT, VOLTAGE = range(len(OUTPUTS))

_TAKEN = [CHANNELS.index(name) for name in OUTPUTS]
_EXTERNAL = CHANNELS.index('external_torque')
_SLOW = 0.03  # rad/s at the load, in which a direction fades
_LOADED = 0.3  # of the usual torque: from there on a flank of the teeth is in contact
FORMULA = 0.01  # share by which a formula may be off, term by term
_SENSORS = {TORQUE: 'torque', LOAD: 'load encoder', CURRENT: 'current', MOTOR: 'motor encoder'}


class Equations:
    """
    The equations of one servo, and the changes that may be sought in them.

    ``names`` of the equations. :meth:`signals` makes of samples what all else is read off: first
    the equations, then what changes are made of. What is ``usual`` of each equation is filled in
    by who has learned it. ``terms``: for each equation (signal, size, drift) of what a term of it
    may be off, and may be off otherwise than while learning.
    """

    def __init__(self, servo: Servo, period: float) -> None:
        self.half = half_of(WINDOW, period)
        taps = balance_taps(servo, period, self.half)
        self.names = [name for name in NAMES if taps[BALANCES.index(name)].any()]
        self._taps = np.array([taps[BALANCES.index(name)][:len(OUTPUTS)] for name in self.names]
                              ).reshape(len(self.names), len(OUTPUTS), -1)
        self._values = servo.values
        self._parts = {sensor.channel for sensor in servo.sensors}
        if 'transmission' in self.names and 'torque' in self._parts:
            self.names.append(RIPPLE)
        self._ratio = servo.values['mechanism.ratio']
        self._lever = self._ratio * servo.values.get('mechanism.efficiency', 1.0)
        self._window = biweight(self.half)
        self._rate = np.gradient(self._window, period)
        self._period = period
        self._index: dict[str, int] = {}
        for name in (*self.names, 'one', 'speed', 'direction', 'turning', 'drag', 'acceleration',
                     'external', 'sine', 'cosine', 'fan', 'current', 'command', 'carried',
                     'flank', 'angle',
                     *(f'{self.names[q]} of {c}' for c in _SENSORS for q in self._with(c)),
                     *(f'{self.names[q]} of one in {c}' for c in _SENSORS for q in self._with(c)),
                     *(f'moving {c}' for c in _SENSORS),
                     *(f'usual {name}' for name in self.names)):
            self._index[name] = len(self._index)
        self.terms = self._terms()
        self.candidates = self._candidates()

    def _with(self, channel: int) -> list[int]:
        """Return the equations that a reading is in."""
        known = OUTPUTS[channel] in self._parts
        return [q for q in range(len(self._taps)) if known and self._taps[q, channel].any()]

    def signals(self, rows: np.ndarray) -> np.ndarray:
        """Return the signals (n, s) of samples (n + 2 half, len(CHANNELS)); NaN: not known."""
        e = rows[:, _TAKEN].T
        e = np.where(np.isfinite(e).any(axis=1)[:, None], e, 0.0)
        size = len(rows) - 2 * self.half

        def of(window: np.ndarray, channel: np.ndarray) -> np.ndarray:
            return np.convolve(channel, window[::-1], 'valid')

        external = of(self._window, np.nan_to_num(rows[:, _EXTERNAL]))
        found = np.zeros((size, len(self._index)))

        def put(name: str, value: np.ndarray | float) -> None:
            found[:, self._index[name]] = value

        for name, taps in zip(self.names, self._taps, strict=False):
            y = sum(of(taps[c], e[c]) for c in range(len(OUTPUTS)) if taps[c].any())
            put(name, y - external * (name in ('load', 'torque_balance')))
        turned = e[MOTOR] / self._ratio if OUTPUTS[MOTOR] in self._parts else e[LOAD]
        angle = of(self._window, e[LOAD] if OUTPUTS[LOAD] in self._parts else turned)
        speed = of(-self._rate, turned)
        faster = np.gradient(speed, self._period) if size > 1 else np.zeros(size)
        carried = of(self._window, e[TORQUE]) if 'torque' in self._parts else (
            external + self._values.get('mechanism.load_inertia', 0.0) * faster)
        if RIPPLE in self.names:
            put(RIPPLE, np.abs(e[TORQUE, self.half:self.half + size] - carried))
        for name, value in (
                ('one', 1.0), ('speed', speed), ('direction', np.tanh(speed / _SLOW)),
                ('turning', np.abs(np.tanh(speed / _SLOW))), ('acceleration', faster),
                ('external', external), ('sine', np.sin(angle)), ('cosine', np.cos(angle)),
                ('fan', speed * np.abs(speed)), ('current', of(self._window, e[CURRENT])),
                ('command', of(self._window, e[VOLTAGE])), ('carried', carried),
                ('angle', angle)):
            put(name, value)
        for c in _SENSORS:
            for q in self._with(c):
                put(f'{self.names[q]} of {c}', of(self._taps[q, c], e[c]))
                put(f'{self.names[q]} of one in {c}', self._taps[q, c].sum())
            put(f'moving {c}', np.abs(np.diff(e[c], prepend=e[c, :1])
                                     [self.half:self.half + size]) > 0.0)
        return found

    def index(self, name: str) -> int:
        """Return the column of a signal."""
        return self._index[name]

    def covariates(self, blocks: np.ndarray) -> np.ndarray:
        """Return how the rig is driven, five columns in the order of excitation_level."""
        return blocks[:, [self._index[name] for name in (
            'speed', 'direction', 'external', 'sine', 'cosine')]]

    def with_flanks(self, blocks: np.ndarray, learned: np.ndarray) -> np.ndarray:
        """
        Fill in which flank of the teeth is in contact, and take the logarithm of the ripple.

        A flank is by the torque usual in ``learned`` blocks; so are the least ripple that counts
        and what a ripple that grows e-fold may drag at the motor.
        """
        usual = _LOADED * np.sqrt(np.square(learned[:, self._index['carried']]).mean()) + 1e-12
        filled = blocks.copy()
        filled[:, self._index['flank']] = np.tanh(blocks[:, self._index['carried']] / usual)
        if RIPPLE in self.names:
            ripple = self._index[RIPPLE]
            least = 1e-3 * np.median(learned[:, ripple]) + 1e-12
            filled[:, ripple] = np.log(np.maximum(blocks[:, ripple], least))
            filled[:, self._index['drag']] = blocks[:, self._index['direction']] * (
                STEEPEST / self._lever * np.median(learned[:, ripple]))
        return filled

    def _terms(self) -> list[list[tuple[int, float, float]]]:
        of = {'drive': [('command', 1.0 if 'drive.resistance' in self._values else -1.0,
                         'drive.gain')],
              'motor': [('current', 1.0, 'drive.torque_constant'),
                        ('acceleration', self._ratio, 'mechanism.rotor_inertia')],
              'load': [('acceleration', 1.0, 'mechanism.load_inertia')]}
        of['torque_balance'] = [*((name, self._lever * factor, path)
                                  for name, factor, path in of['motor']), *of['load']]
        if 'drive.resistance' in self._values:
            of['drive'] += [('current', 1.0, 'drive.resistance'),
                            ('speed', self._ratio, 'drive.back_emf')]
        found = []
        for equation in self.names:
            each = [(self._index[name], factor * FORMULA * self._values.get(path, 0.0))
                    for name, factor, path in of.get(equation, [])]
            found.append([(signal, size, size) for signal, size in each])
        stiffness = self._values.get('mechanism.stiffness', 0.0)
        if 'transmission' in self.names and stiffness:
            found[self.names.index('transmission')] += [
                (self._index['carried'], 1.0 / stiffness, FORMULA / stiffness),
                (self._index['flank'], 1.0, 0.0)]  # the backlash has any width
        return found

    def _candidates(self) -> list[Candidate]:
        found: list[Candidate] = []

        def part(place: str, equation: str, name: str, *signals: str) -> None:
            if equation in self.names:
                q = self.names.index(equation)
                signals = tuple(one.replace('usual', f'usual {equation}') for one in signals)
                found.append(Candidate(place, name, tuple(
                    ((q, self._index[signal], 1.0),) for signal in signals)))

        for equation in ('load', 'torque_balance'):
            for name, signals in (
                    *OF_A_SHAFT, ('unbalance', ('sine', 'cosine')),
                    ('fan', ('fan',)), ('external torque', ('external',))):
                part('load', equation, name, *signals)
        for equation in ('motor', 'torque_balance'):
            for name, signals in (*OF_A_SHAFT, ('torque constant', ('current',))):
                part('motor', equation, name, *signals)
        part('drive', 'drive', 'gain', 'command')
        part('drive', 'drive', 'offset', 'one')
        if 'drive.resistance' in self._values:
            part('drive', 'drive', 'resistance', 'current')
            self._constants(found)
        part('transmission', 'transmission', 'stiffness', 'carried')
        part('transmission', 'transmission', 'backlash', 'flank')
        part('transmission', 'transmission', 'lost motion', 'direction')
        if 'transmission' in self.names:
            found.append(Candidate('transmission', 'transmission error', (),
                                   self.names.index('transmission')))
        self._teeth(found)
        for channel, name in _SENSORS.items():
            entered = self._with(channel)
            if not entered:
                continue
            offset, gain = (tuple((q, self._index[f'{self.names[q]} of {what}{channel}'], 1.0)
                                  for q in entered) for what in ('one in ', ''))
            found.append(Candidate('sensor', f'{name}: offset', (offset,)))
            if channel == TORQUE and RIPPLE in self.names:
                gain += ((self.names.index(RIPPLE), self._index['one'], 1.0),)
            if channel in (TORQUE, CURRENT):
                found.append(Candidate('sensor', f'{name}: gain', (gain,)))
            found.append(Candidate('sensor', f'{name}: stuck', (), stuck=channel))
        return found

    def _teeth(self, found: list[Candidate]) -> None:
        """Add errors of the teeth that come and go within a block, where the torque is read."""
        shapes = tuple(((self.names.index(name), self._index[signal], 1.0),) for name, signal in (
            (RIPPLE, 'turning'), ('motor', 'drag')) if name in self.names)
        if RIPPLE in self.names:
            found.append(Candidate('transmission', 'error of the teeth', shapes, as_one=True))

    def _constants(self, found: list[Candidate]) -> None:
        """Add a magnet that weakens: torque constant and back EMF change by one share."""
        for equation in ('motor', 'torque_balance'):
            if equation in self.names and 'drive' in self.names:
                found.append(Candidate('motor', 'torque and EMF constant', ((
                    (self.names.index(equation), self._index['current'],
                     -self._values['drive.torque_constant']
                     * (self._lever if equation == 'torque_balance' else 1.0)),
                    (self.names.index('drive'), self._index['speed'],
                     self._values['drive.back_emf'] * self._ratio)),)))
