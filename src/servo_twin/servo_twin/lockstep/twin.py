"""The lockstep model: samples in, what the servo's sensors would have read out."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite, nan
from types import MappingProxyType

import numpy as np

from ..physics import state
from ..physics.kernel import kernel_of, starts
from ..physics.servo import MechanismFailure, Servo, ServoError, Value
from ..physics.simulate import initial_state, substeps_of
from ..physics.state import INPUTS, OUTPUTS
from ..recording.joined_samples import (
    control_values,
    Inputs,
    LOAD_POSITION,
    MOTOR_POSITION,
    reference_of,
    TORQUE,
)
from .live_changes import changed, check_mode

_NONE: Mapping[int, str] = MappingProxyType({})
_CHUNK = 8192  # samples a call of the kernel: bounds what is run again when a state blows up


class Twin:
    """
    A servo that runs beside a rig, sample by sample.

    Blocks of samples go in by :meth:`step`, readings of the twin's sensors come out; how the
    samples are cut into blocks changes no bit of the answer. Values (:meth:`set`) and the servo
    itself (:meth:`load`) may be exchanged between two blocks.

    The twin starts itself: angles and torque are those of the first sample, the speed is zero, and
    for ``catch`` seconds it runs as an observer so that it takes up the rig's speed. It does so
    again after more than ``bridge`` missing samples, after a sequence that went back, where an
    encoder has leapt, and when its state is no longer finite. Up to ``bridge`` missing samples
    are stepped over with the last input held. A command, external torque or temperature that is
    NaN is held too; where the reference is NaN in ``closed_loop`` the rig's loop is open: the twin
    takes the rig's command.

    ``restarts``, ``bridged`` (samples) and ``samples`` count; ``why`` says what caused the last
    restart. Raises ServoError for a mode that does not exist or that the servo cannot run in.
    """

    def __init__(self, servo: Servo, period: float, mode: str = 'measured_input',
                 bridge: int = 50, catch: float = 0.1) -> None:
        if not period > 0.0:
            raise ServoError(f'{servo.name}: period = {period} s, it must be positive')
        self.period = period
        self.bridge = bridge
        self.catch = catch
        self.restarts = self.bridged = self.samples = 0
        self.why = ''
        self.breaks: tuple[int, ...] = ()
        """Rows of the last block before which samples were missing or the state began again."""
        self.next: int | None = None
        """Running number that the next sample should have."""
        self._x: np.ndarray | None = None
        self._failed = ''
        self._origin = 0
        self._catching = 0
        self._looped = False
        self._inputs = Inputs()
        self._last = np.zeros(len(INPUTS))
        self._take(servo)
        self.mode = mode

    @property
    def mode(self) -> str:
        """The way of running, one of LIVE_MODES; may be changed between two blocks."""
        return self._mode

    @mode.setter
    def mode(self, mode: str) -> None:
        check_mode(self.servo, mode)
        self._mode = mode
        self._looped = False

    def step(self, sequence: int, samples: np.ndarray, leaps: Mapping[int, str] = _NONE
             ) -> np.ndarray:
        """
        Answer a block of samples, shape (n, len(CHANNELS)), numbered from ``sequence`` on.

        Before the rows of ``leaps`` it begins again, for the reason that is given.

        Returns what the twin's sensors read at the same instants, shape (n, len(OUTPUTS)), SI.
        NaN is what is not measured. Rows after which something was not continuous are in
        :attr:`breaks` afterwards.
        """
        self._breaks: list[int] = []
        self.breaks = ()
        if not len(samples):
            return np.empty((0, len(OUTPUTS)))
        self._follow(sequence)
        y = np.empty((len(samples), len(OUTPUTS)))
        at = 0
        while at < len(samples):
            if at in leaps:
                self._restart(f'{leaps[at]}, by sample {sequence + at}')
            fresh = self._x is None
            if fresh:
                self._begin(sequence + at, samples[at])
                if sequence + at != self._origin:
                    self._breaks.append(at)
            end = min(len(samples), at + _CHUNK, *(row for row in leaps if row > at))
            u, looped = self._inputs.take(samples[at:end], self._reference)
            self._run(u, y[at:end], looped, None if fresh else self._last)
            self._last = u[-1]
            good = np.isfinite(y[at:end]).all(axis=1)
            if good.all():
                at = end
                continue
            bad = at + int(good.argmin())
            self._restart(self._failed or f'the state was not finite at sample {sequence + bad}')
            if fresh and bad == at:  # not even the first sample: pass it over
                y[bad] = nan
                bad += 1
            at = bad
            self._inputs.forget()
        self.samples += len(samples)
        self.next = sequence + len(samples)
        self.breaks = tuple(sorted(set(self._breaks)))
        return y

    def set(self, changes: Mapping[str, Value], source: str | None = None) -> None:
        """
        Change values by path, from the next sample on; ``source`` is their provenance.

        Raises ServoError, changing nothing.
        """
        servo = changed(self.servo, changes, source)
        turned = servo.values['mechanism.ratio'] != self.servo.values['mechanism.ratio']
        self._take(servo)
        if turned and self._x is not None:
            self._align()

    def load(self, servo: Servo) -> bool:
        """
        Run another servo from the next sample on; raises ServoError, changing nothing.

        Keeps angles, speeds and the memories of effects that both have when the mechanism and its
        ratio are the same, and says True; starts again otherwise. Compiles it where it is not yet.
        """
        check_mode(servo, self._mode)
        before, x = self.servo, self._x
        kept = x is not None and before.mechanism is servo.mechanism and (
            before.values['mechanism.ratio'] == servo.values['mechanism.ratio'])
        kernel = kernel_of(servo)
        self._take(servo)
        if x is None:
            return False
        if not kept:
            self._restart(f'{servo.name} was loaded in place of {before.name}')
            return False
        self._x = np.zeros(kernel.state_size)
        self._x[:state.CONTROLLER] = x[:state.CONTROLLER]
        if before.controller is servo.controller:
            self._x[state.CONTROLLER:state.PARTS] = x[state.CONTROLLER:state.PARTS]
        else:
            self._looped = False
        memories = _memories(before)
        for place, slot in _memories(servo).items():
            if place in memories:
                self._x[slot] = x[memories[place]]
        self._align()
        return True

    def _take(self, servo: Servo) -> None:
        self.servo = servo
        self._kernel = kernel_of(servo)
        self._theta, self._on = servo.theta, servo.switches
        self._substeps, self._h = substeps_of(servo, self.period)
        self._reference = reference_of(servo)

    def _align(self) -> None:
        self._kernel.align(self._theta, self._on, self._x, self._x[state.TORQUE])

    def _follow(self, sequence: int) -> None:
        """Bring the state to the sample numbered ``sequence``."""
        if self.next is None or sequence == self.next:
            return
        missing = sequence - self.next
        self._breaks.append(0)
        if missing < 0:
            self._origin = sequence
            self._restart(f'the sequence went back from {self.next - 1} to {sequence}')
        elif missing > self.bridge:
            self._restart(f'{missing} samples were missing before {sequence}, '
                          f'at most {self.bridge} are bridged')
        elif self._x is not None:
            held = np.tile(self._last, (missing, 1))
            held[:, [state.MEASURED_MOTOR, state.MEASURED_LOAD]] = nan
            self._run(held, np.empty((missing, len(OUTPUTS))), np.full(missing, self._looped),
                      self._last)
            self.bridged += missing

    def _restart(self, why: str) -> None:
        self._x = None
        self._failed = ''
        self.restarts += 1
        self.why = why

    def _begin(self, sequence: int, sample: np.ndarray) -> None:
        """Make the state of the first sample."""
        if self.next is None:
            self._origin = self.next = sequence
        motor, load, torque = (v if isfinite(v) else nan for v in (
            sample[MOTOR_POSITION], sample[LOAD_POSITION], sample[TORQUE]))
        self._x = initial_state(self.servo, motor, load, torque)
        self._x[state.TIME] = (sequence - self._origin) * self.period
        self._catching = round(self.catch / self.period)
        self._looped = False

    def _run(self, u: np.ndarray, y: np.ndarray, looped: np.ndarray,
             before: np.ndarray | None) -> None:
        """Run over inputs, ``before`` them a row or none: an observer catches up, then as told."""
        caught = min(self._catching, len(u))
        if caught:
            self._call(u[:caught], y[:caught], state.OBSERVER)
            self._catching -= caught
            before = u[caught - 1]
        if caught == len(u):
            return
        u, y, looped = u[caught:], y[caught:], looped[caught:]
        if self._mode != 'closed_loop':
            self._call(u, y, state.MODES[self._mode])
            return
        edges = [0, *(np.flatnonzero(looped[1:] != looped[:-1]) + 1), len(u)]
        for start, end in zip(edges, edges[1:], strict=False):
            if looped[start] and not self._looped:
                self._close(u[start - 1] if start else before)
            self._looped = bool(looped[start])
            mode = state.CLOSED_LOOP if self._looped else state.MEASURED_INPUT
            self._call(u[start:end], y[start:end], mode)

    def _close(self, before: np.ndarray | None) -> None:
        """
        Close the loop without a bump: its memory is such that it gave the command ``before``.

        Its speed is that of the twin. What it has no integral for stays a bump.
        """
        memory = self._x[state.CONTROLLER:state.PARTS]
        memory[:] = 0.0
        if before is None:
            return
        values, x = self.servo.values, self._x
        ratio = values['mechanism.ratio']
        motor, load = (x[angle] - x[speed] * self.period for angle, speed in (
            (state.MOTOR_ANGLE, state.MOTOR_SPEED), (state.LOAD_ANGLE, state.LOAD_SPEED)))
        on_load = values.get('controller.on_load', 0.0) > 0.5
        speed = x[state.LOAD_SPEED] if on_load else x[state.MOTOR_SPEED] / ratio
        memory[:3] = 1.0, (load if on_load else motor / ratio) - speed * self.period, speed
        command = self.servo.controller.law(
            control_values(self.servo), memory, before[state.REFERENCE_POSITION],
            before[state.REFERENCE_VELOCITY], before[state.ADDED_COMMAND], motor, load, ratio,
            self.period)
        if values.get('controller.ki', 0.0) > 0.0:
            memory[-1] += before[state.VOLTAGE] - command

    def _call(self, u: np.ndarray, y: np.ndarray, mode: int) -> None:
        try:
            self._kernel.run(self._theta, self._on, self._x, u, y, self._substeps, self._h, mode)
        except MechanismFailure as problem:  # what it said is the reason of the restart
            self._failed = str(problem)


def _memories(servo: Servo) -> dict[tuple, slice]:
    """Where the memory of drive, mechanism and each effect stands, by name, kind and site."""
    drive, mechanism, start = starts(servo)
    slots = {('drive', servo.drive, ''): slice(drive, mechanism),
             ('mechanism', servo.mechanism, ''): slice(mechanism, start)}
    for placed in servo.effects:
        slots[placed.name, placed.effect, placed.site] = slice(start, start + placed.effect.memory)
        start += placed.effect.memory
    return slots
