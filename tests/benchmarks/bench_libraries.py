"""
What is written by hand beside the library that would do it, on the sizes of a diagnosis.

Prints processor time of one call, in us, and how far the answers differ. Run with `python`.
"""

from io import BytesIO
from time import process_time

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import lsq_linear
from scipy.signal import lombscargle
from scipy.stats import bootstrap
from speed_table import row

from servo_identify.diagnose.mechanisms.orders import _periodogram, hats
from servo_identify.diagnose.selection.bounded_least_squares import bounded
from servo_twin.pages.svg_charts import line_chart


def microseconds(call, calls=20, rounds=5):
    """Return the least processor time of a call, after a first one that may compile."""
    call()
    times = []
    for _ in range(rounds):
        begun = process_time()
        for _ in range(calls):
            call()
        times.append(1e6 * (process_time() - begun) / calls)
    return min(times)


def bounded_least_squares(unknowns: int) -> None:
    """Gram matrix and slope are there; scipy wants a matrix, here of the Cholesky factor."""
    chance = np.random.default_rng(0)
    table = chance.normal(size=(4000, unknowns))
    gram = table.T @ table
    slope = -table.T @ (table @ chance.normal(size=unknowns) + chance.normal(size=4000))
    high = np.full(unknowns, 0.5)

    def scipys():
        factor = np.linalg.cholesky(gram)
        return lsq_linear(factor.T, np.linalg.solve(factor, -slope), (-high, high),
                          method='bvls').x

    own = bounded(gram, slope, -high, high)
    told(f'bounded least squares, {unknowns} unknowns', lambda: bounded(gram, slope, -high, high),
         'scipy lsq_linear (bvls)', scipys, np.abs(own - scipys()).max())


def hat_functions() -> None:
    """Nine hats over 20 000 samples."""
    x = np.random.default_rng(0).uniform(-1.0, 1.0, 20_000)
    edges = np.linspace(-1.0, 1.0, 9)
    knots = np.concatenate([edges[:1], edges, edges[-1:]])

    def scipys():
        return BSpline.design_matrix(x, knots, 1).toarray()

    told('hat functions', lambda: hats(x, edges), 'scipy BSpline.design_matrix', scipys,
         np.abs(hats(x, edges) - scipys()).max())


def resampled_blocks() -> None:
    """A ratio of sums over 300 blocks, redrawn 200 times: all draws in one product, or scipy's."""
    chance = np.random.default_rng(0)
    before, after = chance.chisquare(5, 300), 0.5 * chance.chisquare(5, 300)

    def by_hand():
        drawn = np.random.default_rng(1).integers(0, 300, (200, 300))
        ratio = after[drawn].sum(axis=1) / before[drawn].sum(axis=1)
        return np.percentile(ratio, (5, 95))

    def scipys():
        found = bootstrap((after, before), lambda a, b, axis=-1: a.sum(axis) / b.sum(axis),
                          paired=True, vectorized=True, n_resamples=200, confidence_level=0.9,
                          method='percentile', rng=1)
        return np.array(found.confidence_interval)

    told('interval by redrawn blocks', by_hand, 'scipy.stats.bootstrap', scipys,
         np.abs(by_hand() - scipys()).max())


def spectrum_of_orders() -> None:
    """200 orders of 20 000 samples, each sample with a weight: one transform, or scipy's sums."""
    chance = np.random.default_rng(0)
    angle, orders = np.sort(chance.uniform(0.0, 30.0, 20_000)), np.arange(1, 201)
    factor = chance.uniform(0.5, 1.0, 20_000) * chance.choice((-1.0, 1.0), 20_000)
    target = factor * np.cos(7.0 * angle) + chance.normal(size=20_000)

    def scipys():
        return lombscargle(angle, target / factor, orders.astype(float), weights=factor**2)

    own = _periodogram(angle, target, factor)[1:]
    told('spectrum of orders (Lomb-Scargle)',
         lambda: _periodogram(angle, target, factor), 'scipy.signal.lombscargle', scipys,
         np.abs(own / own.max() - scipys() / scipys().max()).max())


def charts() -> None:
    """Two curves of 100 000 samples as SVG."""
    from matplotlib.figure import Figure
    time = np.arange(100_000) * 1e-3
    rig = np.sin(time) + np.random.default_rng(0).normal(0.0, 0.01, len(time))

    def matplotlibs():
        figure = Figure(figsize=(9.6, 1.9))
        figure.subplots().plot(time, rig, time, np.sin(time))
        held = BytesIO()
        figure.savefig(held, format='svg')
        return held.getvalue()

    own = line_chart(time, {'rig': rig, 'twin': np.sin(time)}, 'rad')
    told('SVG chart of 100 000 samples',
         lambda: line_chart(time, {'rig': rig, 'twin': np.sin(time)}, 'rad'),
         f'matplotlib ({len(matplotlibs()) / len(own):.0f} times the bytes)', matplotlibs, np.nan)


def told(what, ours, whose, theirs, differ) -> None:
    """Print one line of the table."""
    mine, other = microseconds(ours, 5), microseconds(theirs, 5)
    print(f'{what:<38}{mine:>10.0f} us   {whose:<42}{other:>10.0f} us   x {other / mine:<6.1f}'
          f'differ by {differ:.1e}', flush=True)
    row(what, f'{mine:.0f} us', f'{whose}: {other:.0f} us, {other / mine:.1f} times as long',
        other / mine)


if __name__ == '__main__':
    for size in (5, 12, 30):
        bounded_least_squares(size)
    hat_functions()
    resampled_blocks()
    spectrum_of_orders()
    charts()
