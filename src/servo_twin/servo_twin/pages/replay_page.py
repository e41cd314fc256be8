"""One page about one recording: how the twin answers it, to be read in a minute, offline."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from math import isfinite, log10
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from ..balances.goodness_of_fit import Fit, Fitting
from ..description.whole_file import write_whole
from ..physics.servo import Servo
from ..recording.events import Happened
from ..recording.parts import LongRecording
from ..recording.recording import BALANCES, COMPARED, Predictions, Recording
from .envelopes import Envelopes
from .event_table import rows_of
from .svg_charts import line_chart

CHAIN = (('command', 'controller'), ('drive', 'drive'), ('motor', 'motor'),
         ('transmission', 'transmission'), ('load', 'load'), ('sensors', 'sensor'))
"""What the chain is drawn of: a block, and the balance that tells whether it is as modelled."""

WITHOUT_TORQUE = (*CHAIN[:2], ('motor, load', 'torque_balance'), CHAIN[3], CHAIN[5])
"""The chain of a rig without torque sensor: what acts on either shaft cannot be told apart."""

ANSWERS_TO = {
    'controller': 'gain, filter, integrator windup, sample time',
    'drive': 'gain, bandwidth, saturation, dead band, delay',
    'motor': 'motor-side friction, cogging, torque constant, rotor inertia',
    'transmission': 'backlash, stiffness, hysteresis, transmission error',
    'load': 'load-side friction, gravity, springs, load inertia',
    'sensor': 'delay between channels, quantisation, offset',
    'torque_balance': 'friction on either side, torque constant, inertias: this rig cannot tell',
}
"""What makes a balance depart, as of GAP_METHOD's table of balances."""


class Replayed:
    """What is kept of a replay, however long it is: its fit, and curves as a page draws them."""

    def __init__(self, servo: Servo, recording: LongRecording, drawn: bool = True) -> None:
        self._fitting = Fitting(servo, recording.period)
        self._drawn, self.curves = drawn, Envelopes(len(recording))
        self.restarts = 0
        self.channel_noise: dict[str, float] = {}

    def add(self, recording: Recording, answer: Predictions) -> None:
        """Take in the next part and its answer."""
        first = self._fitting.seen
        pairs = self._fitting.add(recording, answer)
        self.restarts = answer.restarts
        self.channel_noise = dict(zip(COMPARED, answer.channel_noise, strict=True))
        if not self._drawn:
            return
        for name, pair in pairs.items():
            self.curves.add(f'{name} rig', pair.first, pair.rig)
            self.curves.add(f'{name} twin', pair.first, pair.twin)
            self.curves.add(f'{name} gap', pair.first, pair.rig - pair.twin)
        for name in BALANCES:
            self.curves.add(name, first, answer.residual[name])

    @property
    def fit(self) -> Fit:
        """How well the twin answers."""
        return self._fitting.fit


def write_page(path: Path | str, *about: Any, **more: Any) -> Path:
    """Write the page and return its path; further arguments are those of :func:`page_of`."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, page_of(*about, **more))
    return path


def page_of(servo: Servo, recording: LongRecording, replayed: Replayed,
            mode: str = 'measured_input', warnings: Sequence[str] = (),
            happened: Sequence[Happened] = ()) -> str:
    """
    Return the page as HTML that refers to nothing outside itself.

    ``warnings`` are those of recording and answer; ``happened`` is what was told beside the
    samples.
    """
    fit = replayed.fit
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    text = files(__package__).joinpath('replay_page.html').read_text('utf8')
    template = environment.from_string(text)
    head = {'rig': recording.servo or servo.name, 'recording': recording.name,
            'length': f'{recording.duration:.4g} s at '
                      f'{1.0 / recording.period:.6g} Hz',
            'excitation': recording.family or 'not said', 'twin runs': mode.replace('_', ' ')}
    return template.render(
        title=': '.join(dict.fromkeys((head['rig'], recording.name))),
        sentence=sentence(fit, mode), facts=head, fit=fit,
        chain=Markup(_chain(fit)), colour=colour, spoken=spoken, times=times,
        width=_bar_width, channels=_channels(replayed, fit, recording.period),
        balances=_balances(replayed, fit, recording.period), answers_to=ANSWERS_TO,
        warnings=list(warnings), restarts=replayed.restarts,
        servo_file=recording.servo_file, happened=rows_of(happened, recording.start))


def sentence(fit: Fit, mode: str) -> str:
    """Say in one sentence how good the twin is and where it is worst."""
    moving = [c for c in fit.channels if c.channel in ('load_speed', 'motor_speed')]
    said = 'There is nothing that rig and twin both measure.'
    if moving:
        said = (f'Running on {mode.replace("_", " ")}, the twin follows the '
                f'{moving[-1].channel.replace("_", " ")} with R = {moving[-1].goodness:.3f}.')
    if fit.balances:
        worst = max(fit.balances, key=lambda b: b.over_noise)
        if worst.over_noise < 2.0:
            return said + ' No balance departs from what noise alone does.'
        said += (f' It departs most in the {spoken(worst.balance)} balance, '
                 f'{times(worst.over_noise)} times the noise floor.')
    return said


def spoken(balance: str) -> str:
    """Return a balance as people call it."""
    return balance.removesuffix('_balance').replace('_', ' ')


def times(over_noise: float) -> str:
    """Return a multiple of the noise floor in three digits."""
    return f'{over_noise:.3g}' if over_noise < 999.5 else f'{over_noise:.0f}'


def colour(over_noise: float) -> str:
    """Return the CSS class of a residual over its noise floor."""
    if not isfinite(over_noise):
        return 'unknown'
    return 'fine' if over_noise < 2.0 else 'off' if over_noise < 10.0 else 'far'


def _bar_width(over_noise: float) -> float:
    """Return per cent of a bar on a logarithmic scale from 1 to 1000."""
    return 100.0 * min(1.0, max(0.01, log10(max(over_noise, 1.0)) / 3.0))


def _chain(fit: Fit) -> str:
    by_name = {b.balance: b.over_noise for b in fit.balances}
    wide, gap, parts = 130, 34, []
    chain = WITHOUT_TORQUE if 'torque_balance' in by_name else CHAIN
    for k, (block, balance) in enumerate(chain):
        x = k * (wide + gap)
        over = by_name.get(balance, float('nan'))
        said = f'{times(over)} × noise' if isfinite(over) else 'not observable'
        parts.append(
            f'<g class="{colour(over)}"><rect x="{x + 1}" y="14" width="{wide}" height="58" '
            f'rx="9"/><text class="block" x="{x + wide / 2}" y="39" text-anchor="middle">{block}'
            f'</text><text class="said" x="{x + wide / 2}" y="59" text-anchor="middle">{said}'
            f'</text></g>')
        if k < len(chain) - 1:
            parts.append(f'<path class="arrow" d="M{x + wide + 5} 43h{gap - 12}m-6 -5l6 5l-6 5"/>')
    total = len(chain) * (wide + gap) - gap + 2
    return (f'<svg viewBox="0 0 {total} 86" style="max-width: {total}px" role="img" '
            f'aria-label="The chain from command to sensors, coloured by the residual of each '
            f'balance">{"".join(parts)}</svg>')


def _channels(replayed: Replayed, fit: Fit, period: float) -> list[dict]:
    """Return for each compared channel its two charts: rig and twin, and the gap."""
    curves, time = replayed.curves, replayed.curves.times(period)
    shown = []
    for row in fit.channels:
        rig, twin, gap = (curves.curve(f'{row.channel} {of}') for of in ('rig', 'twin', 'gap'))
        shown.append({
            'fit': row, 'curves': Markup(line_chart(time, {'rig': rig, 'twin': twin}, row.unit)),
            'gap': Markup(line_chart(time, {'gap': gap}, row.unit, 110,
                                     replayed.channel_noise.get(row.channel), time_axis=False))})
    order = ('load_speed', 'motor_speed', 'load_position', 'motor_position', 'torque', 'current')
    return sorted(shown, key=lambda s: order.index(s['fit'].channel))


def _balances(replayed: Replayed, fit: Fit, period: float) -> list[dict]:
    time = replayed.curves.times(period)
    return [{'name': one.balance, 'chart': Markup(line_chart(
        time, {'residual': replayed.curves.curve(one.balance)}, '× noise', 110, 1.0))}
        for one in fit.balances]
