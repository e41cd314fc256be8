"""The page docs/pan_tilt.md and the rows of the comparison, from the figures."""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees

from servo_identify.jobs.harmonic_drive_ranking import LINEAR

from ..markdown_tables import cited, table
from .pan_tilt_recordings import SINE, STEP, TONE

_HEAD = f"""# Pan-and-tilt with harmonic drives (paper 004)

{cited('004', '000')}

Made by `servo-identify results --parts pan_tilt`; nothing here is written by hand. The paper gives
curves and no numbers of its machine, so the emulated rig (`config/rigs/pan_tilt_azimuth.yaml`,
`pan_tilt_elevation.yaml`) has the paper's 2 A amplifier and 25 kg payload and the values of a
small harmonic drive. It shares no law with the twin. Its flexspline twists by a logarithm of the
torque and creeps. Its presliding friction acts on a wave generator that the teeth's load brakes.
Its kinematic error swings with the load. Fits saw the training recordings only.

<!-- not run: takes minutes, and bags that it makes -->
```sh
servo-twin run --rig config/rigs/pan_tilt_azimuth.yaml --servo pan_tilt_azimuth
servo-identify harmonic-drives BAG... --servo S.yaml --held-out BAG... -o BEST.yaml
servo-twin linearise --help          # transfer function and state space, figures 6 and 7
```
"""

CHANNELS = {'load_position': ('load, mrad', 1e3), 'torque': ('torque, N m', 1.0),
            'torsion': ('torsion, arcmin', 3437.7), 'current': ('current, mA', 1e3)}
"""Channels of the ranking: what the page says of them, and how many of its units make one."""


def page(found: Mapping) -> str:
    """Return the page."""
    sections = (_step, _sine, _ranking, _diagnosis, _axes)
    return '\n'.join([_HEAD, *(section(found) for section in sections)])


def _step(found: Mapping) -> str:
    rows = [[name, f'{one["final"]:.3f}', f'{one["rise"]:.3f}', _fit(one)]
            for name, one in found['step'].items()]
    return f"""## Step of {STEP:g} V, as figures 8 and 9

The linear model has no limits of current and voltage and no friction but damping.

{table(['', 'final speed, rad/s', '63 % after, s', 'R (paper 000 eq. 13)'], rows)}
![Step](pictures/pan_tilt_step.png)
"""


def _sine(found: Mapping) -> str:
    rows = [[name, f'{100.0 * one["still"]:.1f}', f'{one["top"]:.3f}',
             f'{100.0 * one["flat"]:.1f}', _fit(one)] for name, one in found['sine'].items()]
    return f"""## Sine of {SINE:g} V at {TONE:g} Hz, as figures 10 and 11

The paper's linear model misses "the discontinuity around the zero-output crossing point" that
static friction makes: the load stands still. Its damping was fitted here to the same recordings as
the twin's. The paper also saw the largest speed cut off; how long each curve stays within 2 % of
its largest speed is below.

{table(['', 'at standstill, % of the time', 'largest speed, rad/s', 'within 2 % of it, %',
        'R (paper 000 eq. 13)'], rows)}
![Slow sine](pictures/pan_tilt_sine.png)
"""


def _ranking(found: Mapping) -> str:
    rows = []
    for one in found['ranking']:
        low, high = one['interval']
        shrink = '' if one['name'] == LINEAR else (
            f'{100.0 * one["shrink"]:.0f} % ({100.0 * low:.0f} to {100.0 * high:.0f})')
        rows.append([one['title'], f'{100.0 * one["gap"]:.1f} %', shrink,
                     *(f'{scale * one["errors"][c]:.3g}' for c, (_, scale) in CHANNELS.items()),
                     str(one['free'])])
    values = [[one['title'], ', '.join(
        f'{path} {_number(value)} {unit}'.rstrip() for path, (value, unit) in
        one['values'].items())] for one in found['ranking'] if one['values']]
    return f"""## Which of the five models explains the rig best

Every model was fitted to the same recordings, with all that the servo file gives a tolerance, and
run again as the diagnosis does over recordings that no fit has seen: in stretches whose starts are
estimated. The remaining gap is the root mean square error over all channels, each as a share of
its signal. The shrink is what of the linear model's gap above the noise is gone (90 %, by
recordings redrawn). Models whose intervals overlap are not told apart with certainty. Best:
**{found['best']}**.

{table(['model', 'remaining gap', 'shrink', *(title for title, _ in CHANNELS.values()),
        'numbers fitted'], rows)}
![Shrink of each model](pictures/pan_tilt_models.png)

Torque over torsion of an output that is twisted while the motor holds; grey is the rig. Here only
the models run freely for the whole recording.

![Loops](pictures/pan_tilt_loops.png)

{table(['model', 'what the fit found'], values)}"""


def _diagnosis(found: Mapping) -> str:
    said = found['diagnosis']
    if not said:
        return ''
    where = ', '.join(f'{balance} {ratio:.1f}' for balance, ratio, verdict in said['where']
                      if verdict == 'gap') or 'none'
    causes = ', '.join(said['causes']) or 'none'
    return f"""## What the best model still lacks

`servo-identify diagnose` says on the best model:

> {said['sentence']}

Missing effects accepted: {causes}. Balances
with a gap (in noise floors): {where}. Its gap is {100.0 * said['before']:.1f} % as fitted and
{100.0 * said['after']:.1f} % with the accepted effects, the noise {100.0 * said['floor']:.1f} %.
"""


def _axes(found: Mapping) -> str:
    axes = found['axes']
    low, high = (round(degrees(angle)) for angle in axes['tilt'])
    rows = [[name, *(f'{r:.3f}' for r in fits), f'{axes["rms"][name]:.4f}']
            for name, fits in axes['fit'].items()]
    return f"""## Two axes

The azimuth is driven back and forth by voltage while the elevation nods from {low} to
{high} deg; both emulated axes run in one world
(`python -m servo_rig_driver.emulated.coupled_axes`), in which the moving payload keeps its
angular momentum. The twin's effect `coupled_inertia` takes the recorded position of the elevation
(column `coupled_position`): the inertia of the azimuth is {axes['inertia'][0]:.3f} kg m2 at
{low} deg and {axes['inertia'][1]:.3f} at {high} deg.

{table(['twin of the azimuth', 'R speed', 'R angle', 'RMS of speed, rad/s'], rows)}
![Both axes](pictures/pan_tilt_axes.png)
"""


def comparison_rows(found: Mapping) -> list[dict[str, str]]:
    """Return the rows of docs/comparison.md."""
    step, sine = found['step'], found['sine']
    twin = next(name for name in sine if name.startswith('twin'))
    ranking = [one for one in found['ranking'] if one['name'] != LINEAR]
    order = ', '.join(f'{one["title"]} {100.0 * one["shrink"]:.0f} %' for one in ranking)
    fits = found['axes']['fit']
    moving, level = (fits[name][0] for name in (
        'inertia over elevation', 'elevation taken as level'))
    return [
        _system('step of 5 V: figures 8 and 9', 'rig, linear model, twin',
                f'R of the speed: twin {step[twin]["fit"]:.3f}, linear model '
                f'{step["linear model"]["fit"]:.3f}'),
        _system('slow sine of 3 V: figures 10 and 11', 'rig, linear model, twin',
                f'at standstill {100.0 * sine["rig"]["still"]:.0f} % of the time, twin '
                f'{100.0 * sine[twin]["still"]:.0f} %, linear model '
                f'{100.0 * sine["linear model"]["still"]:.0f} %'),
        _system('five models of the harmonic drive: eq. 3 to 7',
                'all five by name in a servo file, fitted and ranked',
                f"of the linear model's gap gone: {order}"),
        _system('two axes, azimuth inertia over elevation',
                'both emulated axes in one world; twin with the recorded elevation',
                f'R of the azimuth speed {moving:.3f}, with a fixed inertia {level:.3f}')]


def _system(name: str, runs: str, ours: str) -> dict[str, str]:
    return {'system': f'pan and tilt, {name}', 'runs': runs, 'paper': '', 'ours': ours,
            'command': ''}


def _fit(one: Mapping) -> str:
    return f'{one["fit"]:.3f}' if 'fit' in one else ''


def _number(value: float | list[float]) -> str:
    if isinstance(value, (list, tuple)):
        return '(' + ', '.join(f'{v:.3g}' for v in value) + ')'
    return f'{value:.3g}'
