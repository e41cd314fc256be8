"""The page `docs/ema_bench.md` and the rows of the comparison, from the figures of the part."""

from __future__ import annotations

from collections.abc import Mapping

from ..markdown_tables import table

PAPER = {'position': 0.008, 'speed': 0.019, 'current': 0.157}
"""Standard error, % of the signal, in the worst case (paper 002 sections 5.2 to 5.4)."""

PAPER_LATE = 0.346  # s, worst timing of a plateau (section 5.2)
GOAL = 1e-3  # of the time of the model over that of the bench


def page(found: Mapping) -> str:
    """Return the page."""
    return '\n'.join([_head(found), _command(found), _play(found), _identified(found),
                      _grid(found), _diagnosed(found), _time(found)])


def _worst(found: Mapping, signal: str, figure: str) -> Mapping:
    return max(found['grid'], key=lambda case: case['signals'][signal][figure])


def _place(case: Mapping) -> str:
    return f'{1e3 * case["setting"]:g} mm, {case["brake"]:g} N m'


def _head(found: Mapping) -> str:
    rows = []
    for name, paper in PAPER.items():
        worst, wide = _worst(found, name, 'se'), _worst(found, name, 'rmse')
        one, other = worst['signals'][name], wide['signals'][name]
        rows.append([name, f'{paper:g} %', f'{one["se"]:.3g} %', _place(worst),
                     f'{other["rmse"]:.3g} %', f'{other["floor"]:.3g} %',
                     f'{(other["rmse"] / paper) ** 2 + 1:.0f}'])
    ratio = max(case['ratio'] for case in found['grid'])
    return f"""# The EMA bench of paper 002

Made by `servo-identify results --parts ema_bench`; nothing here is written by hand. A servo motor
with a disc brake drives a printed planetary gearbox; the encoder that closes the position loop
meshes with it by a gear on a slide, which sets the backlash. The bench is the emulated one
(`config/rigs/ema_bench.yaml`), which shares no law with the model
(`config/servos/ema_bench.yaml`); the text of the paper has no table of values, so both are of the
classes of its parts.

```
servo-twin run --rig config/rigs/ema_bench.yaml --servo ema_bench --mode closed_loop \\
    --command position --setting amplitude=0.5 --setting frequency=0.1     # --set brake.torque=0
servo-identify sinusoid BAG                                  # frequency and phase of any recording
servo-identify play BAG... --servo S.yaml --settings M... -o NEW.yaml
```

Worst cases over the grid of brake by backlash, model against bench. *Standard error* is the
paper's,
sqrt(MSE / (n - 1)), here with n = {found['grid'][0]['signals']['position']['n']}
(1 kHz); it falls with the number of samples whatever a model does, and the paper's n is not in its
text. So the plain RMS error stands beside it, and the floor. The floor is how much the
bench differs from itself, switched on again at the same settings (two more times). A model can
seem better than that by chance, as the swing of the brake begins anywhere. Per cent are of
the RMS of the bench's signal about its mean.

{table(['signal', 'paper, worst SE', 'here, worst SE', 'at', 'worst RMS error', 'floor there',
        'n for the SE of the paper'], rows)}
Time of the model over time of the bench: {ratio:.2g} at worst (goal {GOAL:g}).

{_verdict(found, ratio)}
"""


def _verdict(found: Mapping, ratio: float) -> str:
    missed = [name for name, paper in PAPER.items()
              if _worst(found, name, 'se')['signals'][name]['se'] > paper]
    plain = [name for name, paper in PAPER.items()
             if _worst(found, name, 'rmse')['signals'][name]['rmse'] > paper]
    floor = [name for name, paper in PAPER.items()
             if min(case['signals'][name]['floor'] for case in found['grid']) > paper]
    said = [f'By the paper\'s own measure {"all three errors are" if not missed else ""}'
            f'{", ".join(missed)}{" is" if missed else ""} '
            f'{"within" if not missed else "beyond"} the paper\'s.']
    if plain:
        said.append(f'Read as plain RMS errors the same per cents are not reached in '
                    f'{", ".join(plain)}')
        said.append(f'(and could not be in {", ".join(floor)}, where the bench repeats itself no '
                    'better anywhere on the grid).' if floor else '.')
    said.append(f'The ratio of times is {"within" if ratio <= GOAL else "beyond"} its goal.')
    return ' '.join(said).replace(' .', '.')


def _command(found: Mapping) -> str:
    worst = {key: max(abs(case[key]) for case in found['grid'])
             for key in ('frequency_error', 'phase_error', 'response_error')}
    amplitude, frequency, duration = found['played'][0]
    return f"""## The command, recovered

Each recording of the grid is {duration:g} s of a sinusoid of {amplitude:g} rad at
{frequency:g} Hz, begun at a phase of its own. The model is never told: the spectrum of the
recorded command says where the frequency is, a constrained optimisation finds phase, amplitude and
offset and corrects the frequency (paper section 4). Largest error of all
{len(found['grid'])} recordings: {worst['frequency_error']:.1g} Hz and
{worst['phase_error']:.1g} rad. From the answer of the load alone, plateaus, noise and all, the
frequency is known to {worst['response_error']:.2g} Hz.
"""


def _play(found: Mapping) -> str:
    rows = [[f'{1e3 * p["setting"]:g}', f'{1e3 * p["drawn"]:.2f}', f'{1e3 * p["width"]:.2f}',
             f'{1e3 * p["std"]:.2f}', f'{1e3 * p["varies"]:.2f}',
             f'{100.0 * (p["width"] / p["drawn"] - 1.0):+.0f} %'] for p in found['play']]
    turn = found['turn']
    amplitude, frequency, duration = found['played'][1]
    return f"""## Play over the setting of the slide (figure 5.1)

Without brake, {duration:g} s of {amplitude:g} rad at {frequency:g} Hz at settings that the grid
does not have. What is lost between motor and encoder, forward less reverse, in cells of the angle;
the torsion by the encoder's friction ({1e3 * found['play'][0]['wound']:.2f} mrad by the servo
file) taken off. The drawing knows involute teeth that touch at 9.6 mm, and no printing: as in the
paper, what was made is off most where the teeth hardly leave each other.

{table(['slide, mm', 'drawing, mrad', 'measured, mrad', '±', 'from cell to cell', 'off by'], rows)}
The gears do not run true: over the turn the backlash varies as 1 {turn['cosine']:+.3f} cos
{turn['sine']:+.3f} sin of the angle, at every setting alike.

![Play over the setting](pictures/ema_bench_play.png)
"""


def _identified(found: Mapping) -> str:
    rows = [[f'`{name}`', f'{before:.4g}', f'{after:.4g}', f'{std:.1g}', unit or '-']
            for name, before, after, std, unit in found['identified']]
    used = '.\n'.join(f'{1e3 * s:g} mm, {b:g} N m, {a:g} rad, {f:g} Hz'
                     for s, b, a, f in found['learned'])
    return f"""## Identification

The recordings are these, with settings, amplitudes and frequencies that the grid does not have.
{used}.
Closed-loop runs over each whole recording; the errors are those of independent residuals, the
least there can be. The force control of the brake swings, is begun again at each start and is in
no record: the model has its mean.

{table(['parameter', 'servo file', 'found', '±', 'unit'], rows)}"""


def _grid(found: Mapping) -> str:
    rows = [[f'{1e3 * case["setting"]:g}', f'{case["brake"]:g}'] + [
        text for name in PAPER for text in (
            f'{case["signals"][name]["mse"]:.2g}', f'{case["signals"][name]["se"]:.2g}',
            f'{case["signals"][name]["rmse"]:.3g} ({case["signals"][name]["floor"]:.2g})')]
        + [f'{1e3 * case["late"]:.0f}'] for case in found['grid']]
    late = max(case['late'] for case in found['grid'])
    head = ['slide, mm', 'brake, N m'] + [f'{name}: {what}' for name in PAPER for what in (
        'MSE', 'SE, %', 'RMS, % (floor)')] + ['late, ms']
    return f"""## The grid (figures 5.4 to 5.11)

Position and speed are the encoder's, speed through a zero-phase low pass of 30 Hz on both; MSE in
rad², (rad/s)², A². *Late*: how far apart model and bench leave a plateau, at worst
{1e3 * late:.0f} ms (the paper: {1e3 * PAPER_LATE:.0f} ms).

![MSE, standard error, RMS error and its floor](pictures/ema_bench_grid.png)
![Model and bench at the strongest brake](pictures/ema_bench_traces.png)

{table(head, rows)}"""


def _diagnosed(found: Mapping) -> str:
    rows = []
    for case in found['diagnosed']:
        balance, noise, share = max(case['where'], key=lambda w: w[2])
        named = [f'{effect} ({100.0 * shrink:.0f} %)'
                 + (f' or {", ".join(others)}' if others else '')
                 for effect, _, shrink, others in case['which']]
        rows.append([case['title'], f'{balance}, {100.0 * share:.0f} % of the gap, '
                     f'{noise:.1f} times its noise', '; '.join(named) or 'none',
                     case['sentence']])
    return f"""## Diagnosis

Of the identified twin, on three recordings of the grid each (to screen, accept and report on): set
as the bench is, and told something else. The swing of the brake is in no effect of the catalogue,
so there is something that the twin lacks even where it is set right. Right answers would be
friction of the motor for the brake, `backlash` for the slide.

{table(['bench', 'where', 'which (shrink), or what looks alike', 'verdict'], rows)}"""


def _time(found: Mapping) -> str:
    ratios = [case['ratio'] for case in found['grid']]
    walls = [case['wall'] for case in found['grid']]
    return f"""## Time

c = t_model / t_bench over the grid, at steps of {1e3 * found['step']:g} ms: processor time, mean
{sum(ratios) / len(ratios):.2g}, worst {max(ratios):.2g}; on the clock, least of several runs, mean
{sum(walls) / len(walls):.2g}, worst {max(walls):.2g} (whatever else the machine was doing). The
first run ever compiles for about a second, once.
"""


def comparison_rows(found: Mapping) -> list[dict[str, str]]:
    """Return the rows of docs/comparison.md."""
    def row(system: str, runs: str, ours: str) -> dict[str, str]:
        return {'system': f'EMA bench, {system}', 'runs': runs, 'paper': '', 'ours': ours,
                'command': ''}

    def error(name: str) -> str:
        worst, wide = _worst(found, name, 'se'), _worst(found, name, 'rmse')
        return (f'standard error {worst["signals"][name]["se"]:.2g} % at worst (n = '
                f'{worst["signals"][name]["n"]}); plain RMS {wide["signals"][name]["rmse"]:.2g} %')

    grid, plays = found['grid'], found['play']
    model = 'closed-loop model on a grid of brake by backlash'
    return [
        row('frequency and phase of the command recovered',
            'spectrum, then constrained optimisation, on any recording',
            f'within {max(abs(c["frequency_error"]) for c in grid):.1g} Hz and '
            f'{max(abs(c["phase_error"]) for c in grid):.1g} rad; by the answer alone '
            f'{max(abs(c["response_error"]) for c in grid):.1g} Hz'),
        row('backlash over the carrier setting: figure 5.1',
            'play measured at settings of the slide',
            f'{1e3 * plays[0]["width"]:.1f} to {1e3 * plays[-1]["width"]:.1f} mrad, each known to '
            f'{1e3 * max(p["std"] for p in plays):.2f}'),
        row('position: figures 5.4 and 5.5', model, error('position')),
        row('speed: figures 5.7 and 5.8', model, error('speed')),
        row('current: figures 5.10 and 5.11', model, error('current')),
        row('time of model over time of bench', model,
            f'{max(c["ratio"] for c in grid):.1g} at worst')]
