"""From residuals to the set of mechanisms that explains them, at its own operating point."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import numpy as np

from servo_twin.physics.motion_evaluation import EVALUATED

from ..mechanisms.builder import Builder
from ..mechanisms.every_hypothesis import hypotheses_of
from ..mechanisms.hypothesis import Hypothesis
from ..residuals.equation_errors import EquationErrors
from ..residuals.nuisance import Nuisance, nuisance_of, value_of
from ..residuals.samples import ResidualSamples
from .bounded_least_squares import bounded
from .choice import Fitted
from .complete import completed
from .regression import Regression
from .search import Explanation, Search
from .small_effects import with_small_effects

ROUNDS = 2  # of finding the operating point: flanks, loads and currents
TURNED = 0.002  # share of samples on another flank that is worth another round
MOVED = 0.05  # share by which the load or the current that the motion asks for is another


@dataclass(frozen=True)
class Explained:
    """Residuals, what was tried on them, and the sets that explain them."""

    samples: ResidualSamples
    nuisance: Nuisance
    hypotheses: list[Hypothesis]
    search: Search
    explanation: Explanation

    @property
    def chosen(self) -> list[Hypothesis]:
        """The hypotheses of the smallest set, in the order in which they were found."""
        return [self.hypotheses[n] for n in self.explanation.smallest.choice.numbers]

    def slim(self, also: Collection[int] = ()) -> Explained:
        """
        Return the same without the columns of what is not in the smallest set: much memory.

        Those of the hypotheses ``also``, by their numbers, are kept.
        """
        chosen = {*self.explanation.smallest.choice.numbers, *also}
        several = [one if number in chosen else replace(one, columns=one.columns.summed())
                   for number, one in enumerate(self.hypotheses)]
        self.search.regression.hypotheses = several
        return replace(self, hypotheses=several)

    def within_tolerance(self) -> dict[str, float]:
        """Return the values of the file as the smallest set has them, by path."""
        given = self.samples.servo.tolerance
        return {path: value_of(self.samples, path, change)
                for path, change in self.nuisances().items() if path in given}

    def nuisances(self) -> dict[str, float]:
        """Return the amplitudes of what may move without a fault in the smallest set, by label."""
        fit, labels = self.explanation.smallest, self.nuisance.labels
        return {labels[column - 1]: float(value) for column, value in zip(
            fit.columns[1:], fit.values[1:], strict=True) if column <= len(labels)}

    def amplitudes(self, number: int, fit: Fitted | None = None) -> np.ndarray:
        """Return the amplitudes of a hypothesis (by its number) in a fit."""
        fit = fit or self.explanation.smallest
        return fit.values[np.isin(fit.columns, self.search.regression.members[number])]


def explained(samples: ResidualSamples, without: Collection[str] = (),
              tick: Callable[[float], None] = lambda share: None) -> Explained:
    """Find the set of mechanisms that explains residuals; ``without`` names what is left out."""
    answer = _explained(samples, without)
    for turn in range(1, ROUNDS):
        tick(turn / ROUNDS)
        errors = [_at(one, n, answer) for n, one in enumerate(samples.errors)]
        if not any(_changed(*pair) for pair in zip(samples.errors, errors, strict=True)):
            break
        samples = ResidualSamples(samples.servo, errors)
        del answer  # the tables of two rounds at once are too much
        answer = _explained(samples, without)
    builder = Builder(answer.samples, explained=True, nuisance=answer.nuisance)
    search, explanation = with_small_effects(
        answer.search, answer.explanation, lambda left: hypotheses_of(builder, left, without))
    search, explanation = completed(search, explanation)
    tick(1.0)
    return replace(answer, hypotheses=search.regression.hypotheses, search=search,
                   explanation=explanation)


def _explained(samples: ResidualSamples, without: Collection[str]) -> Explained:
    nuisance = nuisance_of(samples)
    start = samples.base + nuisance.columns @ bounded(
        nuisance.columns.T @ nuisance.columns, nuisance.columns.T @ samples.base,
        nuisance.low, nuisance.high)
    several = hypotheses_of(Builder(samples, nuisance=nuisance), start, without)
    search = Search(Regression(samples, nuisance, several))
    return Explained(samples, nuisance, several, search, search.explain())


def _at(one: EquationErrors, number: int, answer: Explained) -> EquationErrors:
    """Return a recording with what the explanation adds to its torques."""
    fit = answer.explanation.smallest
    sensed = 'torque' in one.measured.channels
    samples = len(one.measured.recording)
    shift, unseen = np.zeros(samples), {}
    for signal, change in _of_values(one, answer).items():
        unseen[signal] = np.nan_to_num(one.full(change))
    unseen['motor_lost'] = unseen['motor_torque']
    for index in fit.choice.numbers:
        columns = answer.hypotheses[index].columns
        if columns.of is None or columns.signal not in (
                'torque', 'motor_torque', 'load_torque'):
            continue
        series = columns.factor * columns.of(one) @ answer.amplitudes(index)
        series = np.nan_to_num(one.full(series))
        if columns.signal == 'torque':
            shift += series
        else:
            unseen[columns.signal] = unseen.get(columns.signal, 0.0) + series
            mechanism = answer.hypotheses[index].mechanism
            if mechanism.port == 'friction':
                rubs = columns.signal.replace('torque', 'resistance')
                unseen[rubs] = unseen.get(rubs, 0.0) + series
            if columns.signal == 'load_torque' and not mechanism.memory:  # acts in a gap as well
                unseen['load_torque_beside_gap'] = unseen['load_torque_beside_gap'] + series
            if columns.signal == 'motor_torque' and 'current' in mechanism.variables:
                unseen['motor_lost'] = unseen['motor_lost'] + series
    if not sensed:
        shift = shift - unseen.get('load_torque', 0.0)
    return replace(one, shift=shift, unseen=unseen)


def _of_values(one: EquationErrors, answer: Explained) -> dict[str, np.ndarray]:
    """What values that the explanation moves add to the torques on the shafts, N m."""
    theta = one.servo.theta.copy()
    values = answer.within_tolerance()
    for index in answer.explanation.smallest.choice.numbers:
        path = answer.hypotheses[index].path
        if path:
            values[path] = value_of(answer.samples, path, answer.amplitudes(index)[0])
    for path, value in values.items():
        theta[one.servo.place(path)] = value
    change = (one.evaluated(theta, one.motion) - one.evaluated(one.servo.theta, one.motion)).T
    out = dict(zip(EVALUATED, change, strict=True))
    moved = theta - one.servo.theta
    inertia, rotor = (moved[one.slots[f'mechanism.{name}_inertia'].start]
                      if f'mechanism.{name}_inertia' in one.slots else 0.0
                      for name in ('load', 'rotor'))
    motion, ratio = one.motion, one.servo.numbers['mechanism.ratio']
    return {'motor_torque': out['motor_push'] + out['motor_resistance']
            - rotor * ratio * motion['load_acceleration'],
            'load_torque': out['load_push'] + out['load_resistance']
            - inertia * motion['load_acceleration'],
            'load_torque_beside_gap': out['load_push'] + out['load_resistance']}


def _changed(before: EquationErrors, after: EquationErrors) -> bool:
    """Tell whether another round could change anything: other flanks, another load or current."""
    apart = np.abs(before.flank(before.gear_motion) - after.flank(after.gear_motion))
    if float(np.mean(apart > 0.5)) > TURNED:
        return True
    for name in ('predicted_load', 'predicted_current'):
        old, new = getattr(before, name), getattr(after, name)
        if np.sqrt(np.mean((new - old) ** 2)) > MOVED * np.sqrt(np.mean(new**2)):
            return True
    return False
