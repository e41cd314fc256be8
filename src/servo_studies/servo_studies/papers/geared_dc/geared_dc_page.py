"""The page docs/geared_dc.md and the rows of the comparison, from the figures."""

from __future__ import annotations

from collections.abc import Mapping

from servo_identify.learn.friction.learners.network_training import BATCH

from ..markdown_tables import cited, table
from ..paper_systems import SYSTEMS

PAPER = {'rmse': 0.012, 'mae': 0.009, 'r2': 0.982}
"""Of its LSTM on the last part of its recordings, paper 003 table 2; N m, N m, none."""

CLASSICAL = ('coulomb_viscous', 'stribeck', 'dahl', 'lugre')

_HEAD = f"""# The geared DC motor of paper 003

{cited('003', '000')}

Made by `servo-identify results --parts geared_dc`; nothing here is written by hand.

A 12 V motor with a gear of 30:1 whose winding takes the voltage of an amplifier, with one
incremental encoder on its shaft and a current sensor. `config/rigs/dc_gearmotor.yaml` is the
emulated one: presliding friction with ageing contacts, thinning grease, backlash, tooth error,
cogging. `config/servos/dc_gearmotor.yaml` is the twin's data sheet. The paper gives no
data of its motor; its RMSE at its R2 implies friction that varies by 0.089 N m, and the emulated
motor was chosen so
that its friction varies about that much.

<!-- not run: takes minutes, and bags that it makes -->
```sh
servo-twin run --rig config/rigs/dc_gearmotor.yaml --servo dc_gearmotor \\
    --family multilevel_steps --setting amplitude=8
servo-identify experiment multilevel_steps sinusoids --headless --servo dc_gearmotor \\
    --rig config/rigs/dc_gearmotor.yaml --amplitudes 4 8 -o bags
servo-identify friction bags/* --unseen MORE_BAGS... --servo config/servos/dc_gearmotor.yaml -o DIR
```
"""


def page(found: Mapping) -> str:
    """Return the page."""
    return '\n'.join([_HEAD, _recordings(found), _learners(found), _motion(found), _twin(found)])


def _recordings(found: Mapping) -> str:
    rows = [[part, ', '.join(n.replace('_', ' ') for n in several)]
            for part, several in found['recordings'].items()]
    balance = found['balance']
    return f"""## Recordings and eq. 4

{found['duration']:.0f} s at 1 kHz. Steps go to nine levels of voltage, each held for half a
second, in an order of chance that is another for each amplitude; sines have five sizes and
frequencies.

{table(['for', 'recordings'], rows)}
Friction is the torque balance of the paper's eq. 4 at the output, `N K_m i - (N² J_m + J_l) a`,
after a zero-phase low pass of 20 Hz over all channels, with the data sheet's values. Without a
current sensor, the current is `(U - K_e w) / R`: friction by that differs from friction by the
measured current by {1e3 * balance['rms']:.1f} mN m (RMS), where friction varies by
{1e3 * balance['spread']:.0f} mN m; the winding is not that of the data sheet.
"""


def _learners(found: Mapping) -> str:
    learned = found['equation_5']
    count = learned['samples']
    sindy = next((row['sentence'] for row in learned['rows'] if row['name'] == 'sindy'), '')
    return f"""## Friction by every learner

Features of eq. 5 (speed, acceleration, current) at 100 Hz, in windows of 20 samples,
the same for every learner. There are {count['train']} windows to train,
{count['validation']} to stop by,
{count['test']} in the last fifth of each training recording (the paper's kind of split), and
{count['unseen']} of recordings that were not trained on at all. Friction varies there by
{1e3 * learned['spread']:.0f} mN m. The last column says which of the paper's three figures are
met on the unseen recordings. The paper's are of its own motor, on the last part of its recordings.
The LSTM is that of the paper's table 1 (20 samples, 64 units, Adam at 0.001, at most 150 epochs
with early stopping) but for batches of {BATCH}, where the paper has 64.

{_scores(learned)}
Least error on unseen recordings: {learned['best']}.

**What these figures are worth.** Without a torque sensor friction is *computed* from current and
acceleration (eq. 4), and eq. 5 gives both to the learner: the target is a weighted sum of two of
its inputs, whatever friction does. Sparse regression finds that sum:

    {sindy}

A small error here, the paper's too, shows that a learner can subtract; it does not show that it
knows friction. The next table leaves the current out.

![Friction over time](pictures/geared_dc_equation_5_time.png)
![Friction over speed](pictures/geared_dc_equation_5_speed.png)
![Losses](pictures/geared_dc_equation_5_losses.png)

{_all(learned)}"""


def _motion(found: Mapping) -> str:
    learned = found['motion']
    return f"""## Friction from the motion alone

The same rows and learners, given speed and acceleration only, which is what a friction law in a
twin has. While the motor stands, friction is whatever the current asks of it, and no motion tells.
What memory of the motion tells (presliding) is in the window, or in Dahl's and LuGre's state.

{_scores(learned)}
Least error on unseen recordings: {learned['best']}.

![Friction over time](pictures/geared_dc_motion_time.png)
![Friction over speed](pictures/geared_dc_motion_speed.png)
![Losses](pictures/geared_dc_motion_losses.png)

{_all(learned)}"""


def _scores(learned: Mapping) -> str:
    rows = [[row['name'], *(_figure(row[part][key]) for part in ('unseen', 'test')
                            for key in PAPER), _meets(row['unseen'])] for row in learned['rows']]
    paper = [f'**{v:g}**' for v in PAPER.values()]
    head = ['learner', *(f'{key}, {part}' for part in ('unseen', 'last fifth')
                         for key in ('RMSE, N m', 'MAE, N m', 'R2')), 'met']
    return table(head, [*rows, ['**paper 003, LSTM**', '', '', '', *paper, '']])


def _figure(value: float) -> str:
    return f'{value:.5f}' if abs(value) >= 1e-6 else '< 1e-6'


def _all(learned: Mapping) -> str:
    return f"""<details><summary>All figures</summary>

*Beyond* are {learned['samples']['beyond']} windows of the recording of 12 V, faster than any
trained on. Training ends when the validation error has stopped falling, or after
{learned['limit']:.0f} s of the processor. Evaluation is one call of the exported, compiled model.

{learned['table']}
</details>
"""


def _meets(scores: Mapping) -> str:
    met = [name for name, good in (
        ('RMSE', scores['rmse'] <= PAPER['rmse']), ('MAE', scores['mae'] <= PAPER['mae']),
        ('R2', scores['r2'] >= PAPER['r2'])) if good]
    return ', '.join(met) or 'none'


def _twin(found: Mapping) -> str:
    twin, said = found['twin'], found['diagnosis']
    rows = [[name.replace('_', ' '), *(f'{fits[k]:.4f}' for fits in twin['fit'].values())]
            for k, name in enumerate(twin['names'])]
    means = [f'**{sum(fits) / len(fits):.4f}**' for fits in twin['fit'].values()]
    values = [[path, f'{old:.5g}', f'{new:.5g}', f'{std:.2g}', unit]
              for path, (old, new, std, unit) in twin['values'].items()]
    causes = ', '.join(said['effects']) or 'none'
    return f"""## The twin

Free runs over the unseen recordings: the twin is given the voltage and is never corrected; R of
the speed is eq. 13 of paper 000. *Fitted* is the same file after `servo-identify fit` on the
training recordings ({twin['seconds']:.0f} s); without a torque sensor only ratios to the torque
constant are known, so that one stays. *Augmented* is what `servo-identify diagnose` wrote.

{table(['run', *twin['fit']], [*rows, ['**mean**', *means]])}
{table(['parameter', 'data sheet', 'fitted', 'standard error', 'unit'], values)}
![Twin and rig](pictures/geared_dc_twin.png)

`servo-identify diagnose` was given the data sheet. It had half of the training recordings to
select by, the other half to accept by and the unseen ones to report on. It says:

> {said['sentence']}

Effects found: {causes}; on the unseen recordings the gap shrinks by {100 * said['shrink']:.0f} %
against the twin as the data sheet has it.
"""


def comparison_rows(found: Mapping) -> list[dict[str, str]]:
    """Return the rows of docs/comparison.md."""
    tables = {key: {row['name']: row['unseen'] for row in found[key]['rows']}
              for key in ('equation_5', 'motion')}
    names = list(tables['motion'])
    groups = (['lstm'], [n for n in names if n not in ('lstm', *CLASSICAL)], list(CLASSICAL))

    def said(key: str, group: list[str]) -> str:
        rows = tables[key]
        best = min(group, key=lambda n: rows[n]['rmse'])
        s = rows[best]
        return (f'{best} RMSE {_figure(s["rmse"])} N m, MAE {_figure(s["mae"])} N m, R2 '
                f'{s["r2"]:.3f}' + ''.join(f', {n} {rows[n]["r2"]:.3f}' for n in group
                                           if n != best))

    def both(group: list[str]) -> str:
        return (f'with the current among the features, of which the target is a sum: '
                f'{said("equation_5", group)}. From the motion alone: {said("motion", group)}')

    ours = (both(groups[0]), both(groups[1]), said('motion', groups[2]))
    runs = ('rig, twin, fit, diagnosis; the LSTM of table 1, unseen recordings',
            'on the same rows, unseen recordings', 'on the same rows, unseen recordings')
    systems = [system.name for system in SYSTEMS if system.part == 'geared_dc']
    return [{'system': name, 'runs': what, 'paper': '', 'command': '', 'ours': text}
            for name, what, text in zip(systems, runs, ours, strict=True)]
