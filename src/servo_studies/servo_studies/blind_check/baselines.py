"""
What a user would do without a diagnosis, on the recordings of the same case.

All four see what the servo file leaves of each balance (drive, motor, load, transmission), with
its tolerances fitted inside their bounds, so that none is blamed for what a tolerance explains.
They are fitted to the screen recordings and judged by the share of the leftover's rms that they
remove on the report recordings, in the balance that is off most against its own size; nothing is
simulated again.

- `richest friction`: all terms of the richest friction model at once, none of them negative, as in
  BAM (arXiv 2410.08650); what became more than nothing is the cause.
- `stepwise BIC`: terms of the whole library one by one while the Bayesian information criterion of
  samples taken as independent falls.
- `sparse regression`: the whole library by sequentially thresholded least squares, as in SINDy.
- `residual network`: two hidden layers; names nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any
import warnings

import numpy as np
from scipy.optimize import lsq_linear, nnls

from servo_twin.bag import read_recording
from servo_twin.description import servo_file

from .baseline_terms import BALANCES, joined, leftover, library_of, motion_of, Table, tolerances

VISIBLE = 0.01  # share of the friction level below which a fitted friction term is nothing
THRESHOLD = 0.05  # of a balance's leftover, below which a term is dropped by sparse regression
MOST = 12  # steps of the stepwise selection

_MAIN = {'drive': 'current', 'motor': 'current', 'load': 'torque', 'transmission': 'wind_up'}


def compare(servo_path: Path, bags: Mapping[str, list[Path]]) -> dict[str, Any]:
    """Return, by baseline, the causes it names, as {effect, site}, and its shrink on report."""
    servo = servo_file.load(servo_path)
    known = {split: joined([motion_of(read_recording(b), servo) for b in bags[split]])
             for split in ('screen', 'report')}
    answers = {name: {'named': [], 'shrinks': []} for name in
               ('richest friction', 'stepwise BIC', 'sparse regression', 'residual network')}
    for balance in BALANCES:
        fit, test = (leftover(known[split], servo, balance) for split in ('screen', 'report'))
        explained = tolerances(known['screen'], servo, balance)
        share = _bounded(explained[0], fit, explained[1])
        fit = fit - explained[0] @ share
        test = test - tolerances(known['report'], servo, balance)[0] @ share
        size = _rms(test) / _rms(known['report'][_MAIN[balance]])
        library = library_of(known['screen'], servo, balance)
        unseen = library_of(known['report'], servo, balance)
        for name, choose in (('richest friction', _richest), ('stepwise BIC', _stepwise),
                             ('sparse regression', _thresholded)):
            weights = choose(library, fit, known['screen'], balance)
            after = test - sum((w * unseen[key] for key, w in weights.items()), 0.0 * test)
            answers[name]['named'] += [{'effect': effect, 'site': site}
                                       for effect, site in dict.fromkeys(
                                           (k[0], k[1]) for k in weights)]
            answers[name]['shrinks'].append((size, _shrink(test, after)))
        after = test - _network(known['screen'], fit, known['report'])
        answers['residual network']['shrinks'].append((size, _shrink(test, after)))
    for answer in answers.values():
        answer['shrink'] = max(answer.pop('shrinks'))[1]  # in the balance that is off most
    return answers


def _bounded(table: np.ndarray, target: np.ndarray, down: np.ndarray) -> np.ndarray:
    if not table.shape[1]:
        return np.zeros(0)
    scale = np.sqrt(np.mean(table**2, axis=0))
    found = lsq_linear(table / scale, target, (-down * scale, scale))
    return found.x / scale


_FRICTION = ('coulomb_friction', 'viscous_friction', 'quadratic_drag', 'stribeck_friction',
             'load_dependent_friction')


def _richest(library, target, table, balance) -> dict:
    terms = [key for key in library if key[0] in _FRICTION]
    if not terms:
        return {}
    columns = np.array([library[key] for key in terms]).T
    size = np.sqrt(np.mean(columns**2, axis=0)) + 1e-30
    weights = nnls(columns / size, target)[0]
    level = VISIBLE * np.sqrt(np.mean(
        (table['torque'] if balance == 'load' else table['current'])**2))
    level = min(level, np.sqrt(np.mean(target**2)))
    return {key: w / s for key, w, s in zip(terms, weights, size, strict=True) if w > level}


def _stepwise(library, target, table, balance) -> dict:
    keys, n, chosen = list(library), len(target), []

    def bic(members):
        columns = np.array([library[k] for k in members]).T.reshape(n, len(members))
        weights = np.linalg.lstsq(columns, target, rcond=None)[0]
        left = np.mean((target - columns @ weights)**2) + 1e-300
        return n * np.log(left) + len(members) * np.log(n), weights

    best = n * np.log(np.mean(target**2) + 1e-300)
    while len(chosen) < MOST:
        tried = [(bic([*chosen, key])[0], i) for i, key in enumerate(keys) if key not in chosen]
        if not tried or min(tried)[0] >= best:
            break
        best, at = min(tried)
        chosen.append(keys[at])
    return dict(zip(chosen, bic(chosen)[1], strict=True)) if chosen else {}


def _thresholded(library, target, table, balance) -> dict:
    keys = list(library)
    size = np.array([np.sqrt(np.mean(library[k]**2)) + 1e-30 for k in keys])
    columns = np.array([library[k] for k in keys]).T / size
    limit, kept = THRESHOLD * np.sqrt(np.mean(target**2)), np.ones(len(keys), bool)
    weights = np.zeros(len(keys))
    for _ in range(10):
        weights[:] = 0.0
        if kept.any():
            weights[kept] = np.linalg.lstsq(columns[:, kept], target, rcond=None)[0]
        if np.array_equal(kept, np.abs(weights) > limit):
            break
        kept = np.abs(weights) > limit
    return {k: w / s for k, w, s in zip(keys, weights, size, strict=True) if w}


def _network(fit: Table, target: np.ndarray, test: Table) -> np.ndarray:
    from sklearn.neural_network import MLPRegressor

    def features(t: Table) -> np.ndarray:
        return np.array([np.cos(t['load']), np.sin(t['load']), np.cos(t['motor']),
                         np.sin(t['motor']), t['w_load'], t['a_load'], t['torque'], t['current'],
                         t['command'], np.sign(t['w_load'])]).T

    columns, size = features(fit), np.sqrt(np.mean(target**2)) + 1e-30
    middle, spread = columns.mean(axis=0), columns.std(axis=0) + 1e-12
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')  # that it might have been trained for longer
        network = MLPRegressor(hidden_layer_sizes=(24, 24), early_stopping=True, max_iter=60,
                               random_state=1)
        network.fit((columns - middle) / spread, target / size)
    return size * network.predict((features(test) - middle) / spread)


def _shrink(before: np.ndarray, after: np.ndarray) -> float:
    return float(1.0 - _rms(after) / (_rms(before) + 1e-300))


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
