"""
What a law of one variable, of no given form, would explain in the place of a cause.

Where a law that nobody knows acts, its nearest relative in the catalogue takes up a part of it.
The two are told apart by what the relative leaves: a law of the right variable, whatever its form,
takes all that it took and more, and leaves nothing for it to do.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from servo_twin.physics.effect import Effect

from .ambiguity import taken_from
from .balance import BALANCES
from .candidates import Candidate
from .completeness import features, VARIABLES
from .periodic_law import periodically_outdone_by
from .plain_law import KEPT, plainly_outdone_by
from .screening import Screening

OTHER = 1.1  # times a cause's gain that a free law of another variable must take away
OWN = 1.5  # the same of one of its own variables: then the form of its law is not that of the rig
MEMORY = 1.0  # the same of the speed where it has a memory: that is for what no such law can do
VALUE = 1.025  # the same where the cause is a value that is off: its law is that of the servo
OPEN = 0.1  # share of a balance's first gap that may stay: or more is missing there than one law
KNOTS = {'angle of the load': 24, 'angle of the motor': 24}
FEWER = 12  # knots of the other variables
NOT_ALONE = ('direction', 'temperature')  # two values; a slow drift is one of time

_TORQUES = ('torque', 'wind-up', 'current')  # each is about proportional to the others
_MEANS = {
    'speed': ('speed', 'direction', 'acceleration'), 'direction': ('direction', 'speed'),
    'torque': _TORQUES, 'current': _TORQUES, 'rate': ('speed', 'acceleration'),
    'load_angle': ('angle of the load',), 'motor_angle': ('angle of the motor',),
    'time': ('time',), 'temperature': ('time',), 'travel': ('travel since reversal',),
}


def undisputed(screening: Screening, chosen: list[int],
               ) -> tuple[list[int], list[str], dict[str, tuple[str, ...]]]:
    """
    Return (causes that no other law makes needless, what is to be said, variables of such laws).

    The least is asked first: once it is gone, the next may have more to do. The variables are by
    the balance in which the law acts.
    """
    kept, said, disputed = list(chosen), [], {}
    for one in sorted(chosen, key=lambda c: screening.loss([o for o in chosen if o != c])):
        variables = _outdoing(screening, kept, one)
        if variables:
            rest = [c for c in kept if c != one]
            disputed |= dict.fromkeys(taken_from(screening, rest, kept), variables)
            label = screening.library.candidates[one].label
            said.append(f'{label} explains a part, but not as its cause, and is not taken: '
                        f'a law of the {" times the ".join(variables)} alone would do no less')
            kept = rest
    return kept, said, disputed


def _outdoing(screening: Screening, chosen: list[int], one: int) -> tuple[str, ...]:
    """Return the variables of the law that makes a chosen cause needless, () without one."""
    if variable := plainly_outdone_by(screening, chosen, one):
        return (variable,)
    if variables := periodically_outdone_by(screening, chosen, one):
        return variables
    variable = outdone_by(screening, chosen, one)
    return (variable,) if variable else ()


def outdone_by(screening: Screening, chosen: list[int], one: int) -> str:
    """
    Return the variable of a free law that makes a chosen cause needless, '' where there is none.

    It must close the balance, or it takes up parts of several. A constant of either parity is a
    free law of any variable and tells nothing: the cause is given one too.
    """
    candidate = screening.library.candidates[one]
    rest = [c for c in chosen if c != one]
    without, times = screening.loss(rest), _times(candidate)
    better: list[tuple[float, str]] = []
    for balance in taken_from(screening, rest, chosen):
        known = features(screening.stack, balance)
        constants = screening.stack.columns_of(balance, _constants(known))
        gain = without - screening.loss_beside(chosen, constants)
        must = _excess(screening, balance, rest) - OPEN * _excess(screening, balance, [])
        for variable, values in _free_laws(known):
            table = screening.stack.columns_of(balance, values)
            left = screening.loss_beside(rest, table)
            more = max(times[variable] * gain, must)
            if without - left > more and left - screening.loss_beside(chosen, table) < KEPT * gain:
                better.append((left, variable))
    return min(better, default=(0.0, ''))[1]


def _excess(screening: Screening, balance: str, chosen: list[int]) -> float:
    """Sum of squares of a balance that is more than noise and margin, as the loss counts it."""
    rows = screening.stack.balance == BALANCES.index(balance)
    squares = screening.residual(chosen)[rows]**2 - 1.0
    return max(0.0, float(np.sum(squares * screening.weight[rows]**2)))


def _times(candidate: Candidate) -> dict[str, float]:
    """Return by variable how many times the gain of a cause a free law of it must take away."""
    if candidate.effect is None:
        return dict.fromkeys(VARIABLES, VALUE)
    own = _own(candidate.effect, candidate.site)
    times = {variable: OWN if variable in own else OTHER for variable in VARIABLES}
    if candidate.effect.memory and candidate.effect.port == 'torque':
        times['speed'] = MEMORY
    return times


def _own(effect: type[Effect], site: str) -> set[str]:
    """Variables of the law of an effect, and those that go with them."""
    own = {name for read in effect.variables() for name in _MEANS.get(read, ())}
    if 'angle' in effect.variables():
        own.update(('angle of the motor' if site == 'motor' else 'angle of the load',
                    'travel since reversal'))
    if effect.port == 'friction':  # each law of it turns with the speed
        own.update(('speed', 'direction'))
    if effect.port in ('mesh', 'clearance'):
        own.update(_TORQUES)
    if effect.port in ('sensor', 'drive'):
        own.update((*_TORQUES, 'speed', 'acceleration'))
    if effect.memory:
        own.add('travel since reversal')
    return own


def _constants(known: np.ndarray) -> np.ndarray:
    """Return a constant and one that turns with the direction of motion, shape (rows, 2)."""
    way = known[:, VARIABLES.index('direction')]
    return np.column_stack((np.ones(len(way)), way))


def _free_laws(known: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Yield (variable, hat functions) of laws even and odd in the direction of motion."""
    way = known[:, VARIABLES.index('direction')]
    for number, variable in enumerate(VARIABLES):
        if variable in NOT_ALONE:
            continue
        hats = _hats(known[:, number], KNOTS.get(variable, FEWER))
        for sign in (np.ones(len(way)), way) if hats.shape[1] > 2 else ():
            yield variable, hats * sign[:, None]


def _hats(values: np.ndarray, knots: int) -> np.ndarray:
    """Return the hat functions of a variable over its quantiles, shape (rows, knots)."""
    at = np.unique(np.quantile(values, np.linspace(0.0, 1.0, knots)))
    return np.column_stack([np.interp(values, at, row) for row in np.eye(len(at))])
