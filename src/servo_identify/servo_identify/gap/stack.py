"""All balances of all recordings as one regression: what is left, what each cause would move."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .balance import Balance, BALANCES
from .candidates import Candidate, Extended
from .mesh_zero import slope_of_zero
from .noise import doubt_about, noise_floor, signal_of

NOTICED = 1.3  # mean square of residuals, in squares of noise and margin, that is a gap
PLAIN = 2.0  # the same of one family of excitation alone: fewer rows, and the worst of several
LARGEST = 1e5  # a law that runs away moves a residual by no more than this
PRACTICAL = 0.005  # share of a balance's own signal below which a gap does not matter
JITTER = 0.15  # samples, by which instants of sampling scatter unseen
CONVENTION = (-1.1, 0.2)  # samples: a reading may be taken before or after the command acts
SHIFT = 0.7  # samples by which a channel may be sampled early or late without being wrong


@dataclass(frozen=True)
class Beside:
    """Values of the servo fitted beside a candidate, and what their columns say is left there."""

    theta: np.ndarray
    residual: np.ndarray


@dataclass
class Stack:
    """
    Residuals of several recordings, divided by their noise and a practical margin.

    A row is one instant of one balance of one recording; ``block`` numbers the stretches of
    a second or so that may be taken as independent, ``balance`` indexes
    BALANCES; ``doubt`` is what a row may be off beside its noise, in the unit of its balance. Rows
    where nothing can be said (standstill, missing samples) are left out for good.
    """

    balances: list[Balance]
    extended: Extended
    base: np.ndarray = field(init=False)
    block: np.ndarray = field(init=False)
    balance: np.ndarray = field(init=False)
    recording: np.ndarray = field(init=False)
    scale: np.ndarray = field(init=False)
    doubt: np.ndarray = field(init=False)
    noise: dict[tuple[int, str], float] = field(init=False)

    def __post_init__(self) -> None:
        theta, on = self.extended.theta, self.extended.on
        self._keep, self._part, self.noise = {}, {}, {}
        block, balance, recording, scale, doubt, first, size = [], [], [], [], [], 0, 0
        for number, one in enumerate(self.balances):
            residuals = one.residuals(theta, on)
            for name, values in residuals.items():
                keep = np.isfinite(values) & one.moving(name)
                self._keep[number, name] = keep
                self.noise[number, name] = noise_floor(one, name, theta)
                margin = PRACTICAL * signal_of(one, name, theta)
                times = one.times(name)[keep]
                self._part[number, name] = slice(size, size + int(keep.sum()))
                size += int(keep.sum())
                doubt.append(doubt_about(one, name)[keep])
                scale.append(np.hypot(doubt[-1], np.hypot(self.noise[number, name], margin)))
                block.append(first + (times / one.seen.block).astype(int))
                balance.append(np.full(len(times), BALANCES.index(name)))
                recording.append(np.full(len(times), number))
            first += int(one.seen.recording.duration / one.seen.block) + 1
        self.block = np.concatenate(block) if block else np.zeros(0, int)
        self.balance = np.concatenate(balance) if balance else np.zeros(0, int)
        self.recording = np.concatenate(recording) if recording else np.zeros(0, int)
        self.scale = np.concatenate(scale) if scale else np.zeros(0)
        self.doubt = np.concatenate(doubt) if doubt else np.zeros(0)
        self._timing = self._timing_columns()
        # where a signal jumps within a sample, its instant decides: such rows weigh less
        self.scale = self.scale * np.sqrt(1.0 + sum(
            (JITTER * column) ** 2 for label, column, _ in self._timing if label != 'shift:load'))
        self._timing = self._timing_columns()
        self.base = self.at(theta, on)

    def at(self, theta: np.ndarray, on: np.ndarray,
           only: tuple[str, ...] | None = None, before: np.ndarray | None = None) -> np.ndarray:
        """
        Return all residuals at some values and switches, in units of their scale.

        ``only`` names the balances that can have changed; the others are those of ``before``,
        which is `base` if it is not given.
        """
        before = self.base if only is not None and before is None else before
        answer = np.zeros(len(self.scale)) if only is None else before.copy()
        with np.errstate(over='ignore', invalid='ignore'):  # laws that run away: clipped below
            for number, one in enumerate(self.balances):
                for name, values in one.residuals(theta, on, only).items():
                    part = self._part[number, name]
                    kept = np.nan_to_num(values[self._keep[number, name]]) / self.scale[part]
                    answer[part] = np.clip(kept, -LARGEST, LARGEST)
        return answer

    def kept(self, number: int, balance: str) -> np.ndarray:
        """Which centres of a balance of a recording are rows, bool."""
        return self._keep[number, balance]

    def at_rows(self, balance: str, of: Callable[[Balance], np.ndarray]) -> np.ndarray:
        """Return at the rows of a balance what is known of each recording at its centres."""
        return np.nan_to_num(np.concatenate(
            [of(one)[self.kept(number, balance)] for number, one in enumerate(self.balances)
             if balance in one.names]))

    def columns_of(self, balance: str, values: np.ndarray) -> np.ndarray:
        """Return physical values at the rows of a balance as columns of all rows, of size one."""
        rows = self.balance == BALANCES.index(balance)
        table = np.zeros((len(self.base), values.shape[1]))
        table[rows] = values / self.scale[rows][:, None]
        size = np.sqrt(np.mean(table**2, axis=0))
        return table / np.where(size > 0.0, size, 1.0)

    def series(self, number: int, balance: str, residual: np.ndarray) -> np.ndarray:
        """Return a residual at all centres of a balance of a recording, NaN where it is no row."""
        full = np.full(len(self._keep[number, balance]), np.nan)
        full[self._keep[number, balance]] = residual[self._part[number, balance]]
        return full

    def showing(self, residual: np.ndarray, least: float = PLAIN) -> dict[str, np.ndarray]:
        """
        Return by balance the rows, bool, in which it shows what gap it has: all of them.

        Where no balance has a gap as a whole, those of the family of excitation that shows most,
        if that is ``least``: a ripple that a fast motion blurs is plain at a creep.
        """
        rows = {BALANCES[i]: self.balance == i for i in np.unique(self.balance)}
        if any(np.mean(residual[r]**2) > NOTICED for r in rows.values()):
            return rows
        told = [one.seen.recording for one in self.balances]
        family = np.array([one.family or one.name for one in told])[self.recording]
        for name, whole in rows.items():
            parts = [whole & (family == f) for f in np.unique(family[whole])]
            most = max(parts, key=lambda part: np.mean(residual[part]**2))
            if np.mean(residual[most]**2) > least:
                rows[name] = most
        return rows

    def nuisances(self) -> tuple[list[str], np.ndarray, np.ndarray, np.ndarray]:
        """
        Return what may move without anything being missing: (names, columns, low, high).

        Parameters within their tolerance (those of the controller for each recording on its own:
        gains are settings), the zero of the wind-up and the first integral of the controller of
        each recording, and the instants of sampling within a part of a sample.
        """
        return self._nuisances

    @cached_property
    def _nuisances(self) -> tuple[list[str], np.ndarray, np.ndarray, np.ndarray]:
        servo = self.extended.servo
        labels, columns, low, high = [], [], [], []
        for path, (least, most) in servo.tolerance.items():
            if path.split('.')[0] in ('sensors', 'observer') or most <= least:
                continue
            value = self.extended.theta[self.extended.slot(path)]
            column = self.derivative(path, 0, 0.25 * (most - least))
            if np.abs(column).max(initial=0.0) == 0.0:
                continue
            parts = [(path, column)]
            if path.startswith('controller.'):
                parts = [(f'{path}:{n}', np.where(self.recording == n, column, 0.0))
                         for n in range(len(self.balances))]
            for label, part in parts:
                labels.append(label)
                columns.append(part)
                low.append(least - value)
                high.append(most - value)
        for label, column, bound in self._timing:
            labels.append(label)
            columns.append(column)
            low.append(bound[0])
            high.append(bound[1])
        for number, one in enumerate(self.balances):
            for label, name, values in _offsets(one):
                column = self._flat({number: {name: values}})
                if column.any():
                    labels.append(f'{label}:{number}')
                    columns.append(column)
                    low.append(-np.inf)
                    high.append(np.inf)
        table = np.column_stack(columns) if columns else np.zeros((len(self.base), 0))
        return labels, table, np.array(low), np.array(high)

    def derivative(self, path: str, element: int, step: float) -> np.ndarray:
        """Change of all residuals for one unit of a parameter, by a step that stays inside."""
        return self._one_after_the_other([(path, element, step)])[:, 0]

    def columns(self, candidate: Candidate, amplitudes: np.ndarray,
                beside: Beside | None = None) -> np.ndarray:
        """
        Change of all residuals for one unit of each amplitude of a candidate.

        Taken between the value at which it vanishes and ``amplitudes``, so that laws with kinks
        are seen at the size at which they matter, and a law of the mesh ``beside`` what else is
        fitted, where that is known.
        """
        numbers = list(zip(candidate.paths, candidate.elements, amplitudes, strict=True))
        if candidate.switch is None:
            return self._one_after_the_other(numbers)
        if candidate.bends_mesh and beside is not None:
            return self._in_full(candidate, numbers, beside)
        table = np.empty((len(self.base), len(numbers)))
        for i, (path, element, amplitude) in enumerate(numbers):
            theta, on = self.with_shapes(candidate)
            theta[self.extended.slot(path, element)] += amplitude
            table[:, i] = (self.at(theta, on, self.touched(candidate)) - self.base) / amplitude
        return table

    def _in_full(self, candidate: Candidate, numbers: list[tuple[str, int, float]],
                 beside: Beside) -> np.ndarray:
        """
        Columns of a law of the mesh that with what is beside it make up all that is left.

        A gap that opens takes away what a stiffness, a zero of the wind-up or the width of
        another gap did in it. No column of theirs says so; those of the law do, where it fits.
        """
        touched, rows = self.touched(candidate), self.balance == BALANCES.index('transmission')
        without = before = self.at(beside.theta, self.extended.on, touched)
        theta, on = self.with_shapes(candidate, beside.theta)
        table = np.empty((len(self.base), len(numbers)))
        for i, (path, element, amplitude) in enumerate(numbers):
            theta[self.extended.slot(path, element)] += amplitude
            after = self.at(theta, on, touched)
            table[:, i], before = (after - before) / amplitude, after
        sizes = np.array([amplitude for *_, amplitude in numbers])
        most = np.argmax(np.mean(table**2, axis=0) * sizes**2)
        table[rows, most] += (without - beside.residual)[rows] / sizes[most]
        return table

    def _one_after_the_other(self, numbers: list[tuple[str, int, float]]) -> np.ndarray:
        """
        Change of all residuals for one unit of each of some parameters: (path, element, step).

        Each starts where the one before went, so that all steps together are exact: gains that
        multiply each other are seen at the size at which they are off.
        """
        table, before = np.zeros((len(self.base), len(numbers))), self.base
        theta = self.extended.theta.copy()
        for i, (path, element, step) in enumerate(numbers):
            slot = self.extended.slot(path, element)
            start = theta[slot]
            least, most = self.extended.declaration(path).bounds
            if start + step > most:
                step = -step
            theta[slot] = min(max(start + step, least), most)
            if theta[slot] != start:
                after = self.at(theta, self.extended.on)
                table[:, i] = (after - before) / (theta[slot] - start)
                before = after
        return table

    def touched(self, candidate: Candidate) -> tuple[str, ...] | None:
        """Balances that an effect can move; None: any."""
        port = candidate.effect.port if candidate.effect else ''
        measured = all(one.seen.has('current') for one in self.balances)
        torque = all(one.seen.has('torque') for one in self.balances)
        if port == 'drive' and measured:
            return ('drive',)
        if candidate.bends_mesh and torque:
            return ('transmission',)
        if port in ('torque', 'friction', 'mesh', 'clearance', 'mesh_error'):
            return ('motor', 'load', 'torque', 'transmission')
        return None

    def with_shapes(self, candidate: Candidate,
                    theta: np.ndarray | None = None, on: np.ndarray | None = None):
        """Return (theta, on) with a candidate switched on at its shapes, amplitudes vanished."""
        theta = (self.extended.theta if theta is None else theta).copy()
        on = (self.extended.on if on is None else on).copy()
        for path, value in candidate.shapes:
            theta[self.extended.slot(path)] = value
        if candidate.switch is not None:
            on[candidate.switch] = True
        return theta, on

    def _timing_columns(self) -> list[tuple[str, np.ndarray, tuple[float, float]]]:
        """Return (name, column, bounds in samples): readings taken a part of a sample off."""
        theta = self.extended.theta
        servo = self.extended.servo
        gain = servo.values['drive.torque_constant']
        ratio = servo.values['mechanism.ratio']
        stiffness = servo.values.get('mechanism.stiffness', 0.0)
        table: dict[str, dict] = {}
        for number, one in enumerate(self.balances):
            seen, bump = one.seen, one.seen.bump
            period, names = seen.period, one.names
            current = seen.channels.current
            if not seen.has('current'):
                current = one.model_current(theta, self.extended.on)
            push = gain * bump.weigh(current, 1) * period
            if 'motor' in names:
                pull = bump.weigh(seen.channels.torque, 1) * period
                put = {'motor': push}
                table.setdefault('shift:current', {})[number] = put
                put = {'motor': -pull / ratio, 'load': pull}
                if 'transmission' in names and stiffness:
                    felt = seen.mesh.weigh(seen.channels.torque, 1) * period
                    put['transmission'] = -felt / stiffness
                table.setdefault('shift:torque', {})[number] = put
            elif 'torque' in names:
                table.setdefault('shift:current', {})[number] = {'torque': ratio * push}
            if 'transmission' in names:
                speed = one.weighed('load_speed', 'transmission') * period
                table.setdefault('shift:load', {})[number] = {'transmission': speed}
            if 'drive' in names:
                made = one.model_current(theta, self.extended.on)
                put = {'drive': seen.fine.weigh(made, 1) * period}
                table.setdefault('shift:drive', {})[number] = put
            if 'controller' in names:
                put = {'controller': seen.fine.weigh(seen.voltage, 1) * period}
                table.setdefault('shift:controller', {})[number] = put
        return [(label, self._flat(by_recording),
                 CONVENTION if label in ('shift:drive', 'shift:controller') else (-SHIFT, SHIFT))
                for label, by_recording in table.items()]

    def _flat(self, by_recording: dict[int, dict[str, np.ndarray]]) -> np.ndarray:
        flat = np.zeros(len(self.scale))
        for number, columns in by_recording.items():
            for name, values in columns.items():
                part = self._part[number, name]
                flat[part] = np.nan_to_num(values[self._keep[number, name]]) / self.scale[part]
        return flat


def _offsets(one: Balance) -> Iterator[tuple[str, str, np.ndarray]]:
    """Yield (label, balance, values at its centres) of what a recording may begin with."""
    if 'transmission' in one.names:
        yield 'zero', 'transmission', slope_of_zero(one)
    if 'controller' in one.names and one.servo.values.get('controller.ki'):
        yield 'integral', 'controller', np.ones(len(one.times('controller')))
