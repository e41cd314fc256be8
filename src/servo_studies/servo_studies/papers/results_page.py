"""The page `docs/results.md`, from the figures of each part."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from servo_identify.learn.transmission.transmission_harmonics import ARCMIN

from .markdown_tables import cited, table

_HEAD = """# Results

Made by `make results` (`servo-identify results`); nothing here is written by hand. The bench is
the emulated one, which shares no law and no file with the models; what they know of it they
learned from its training recordings.
"""


def page(parts: Mapping[str, Mapping]) -> str:
    """Return the page; a part without figures is left out."""
    sections = [_HEAD]
    for name, section in _SECTIONS.items():
        if name in parts:
            sections.append(section(parts[name]))
            sections.append(f'*{made_on(parts[name])}.*\n')
    return '\n'.join(sections)


def made_on(found: Mapping) -> str:
    """Return when the figures of a part were made, and how long that took."""
    when = f'Made on {found["made"]}' if 'made' in found else 'Made'
    return f'{when}, in {found["seconds"]:.0f} s'


def _bench(found: Mapping) -> str:
    models = list(found['open_loop'])
    return '\n'.join([
        _open_loop(found, models), _ladder(found), _closed(found, models), _factors(found)])


def _open_loop(found: Mapping, models: list[str]) -> str:
    fits = found['open_loop']
    rows = [[name.replace('_', ' ')] + [f'{fits[m][what][k]:.3f}' for what in ('speed', 'angle')
                                        for m in models]
            for k, name in enumerate(found['names'])]
    for title, pick in (('**mean**', lambda v: sum(v) / len(v)), ('**least**', min)):
        rows.append([title] + [f'**{pick(fits[m][what]):.3f}**' for what in ('speed', 'angle')
                               for m in models])
    shapes = {shape: [sum(v) / len(v) for m in ('traditional', 'hybrid') for v in [[
        r for n, r in zip(found['names'], fits[m]['speed'], strict=True)
        if n.startswith(shape)]]] for shape in ('sine', 'square')}
    return f"""## Open loop, as table 4 of paper 000

{cited('000', '001', '003')}

Goodness of fit R (eq. 13) of free runs: the twin begins where the rig begins, is given the voltage
for eleven seconds and is never corrected. The paper records the angular velocity and titles the
table with the angular response, so both are here: the speed of the load, and its angle from the
start. Every error of speed adds up in the angle, since nothing holds it in open loop. Below zero
the drift is larger than the motion.

*Traditional* is Stribeck friction, a fixed dead zone and second-order harmonics of transmission
error, on the mechanism of eq. 1; its friction, both inertias and the torque constant were fitted
to the training runs so that R itself is as large as it can be. *Traditional + residual network* is
the black-box end of the scale (paper 001 eq. 27): ten sigmoids over current and speed add the
torque that the traditional model lacks. *Hybrid* is the mechanism of the data sheet with what was
learned: friction networks at load and motor, backlash network, transmission error, current loop,
friction that grows with load, presliding. Training runs are 1.45, 1.65 and 1.9 V at 0.7 and
1.3 Hz; none of the sixteen was trained on.

{table(['run', *(f'R speed, {m}' for m in models), *(f'R angle, {m}' for m in models)], rows)}
Means over sine and square (speed): traditional {shapes['sine'][0]:.3f} and
{shapes['square'][0]:.3f}, hybrid {shapes['sine'][1]:.3f} and {shapes['square'][1]:.3f}; the
paper's rig gave 0.853 and 0.887 against 0.921 and 0.956.

![R of each run](pictures/results_fits.png)
![Speed and its error in open loop, as figure 11](pictures/results_open_loop.png)
"""


def _ladder(found: Mapping) -> str:
    rows = [[r['model'], f'{r["mean"]:.4f}', f'{r["least"]:.4f}', f'{r["angle_mean"]:.3f}']
            for r in found['ladder']]
    loop, share, bristle = found['current_loop'], found['load_share'], found['presliding']
    droop, electrical, closed = (loop['values'][f'effects.back_emf_droop.{n}'] for n in (
        'droop', 'electrical', 'closed'))
    return f"""### What each part of the hybrid brings

{table(['model', 'mean R speed', 'least', 'mean R angle'], rows)}
- **Current loop**: the back EMF of an accelerating motor pulls the current away from its command.
  Fitted to the measured current alone: {1e6 * droop:.2f} uA s2/rad, {1e3 * electrical:.3f} ms,
  {1e3 * closed:.3f} ms; it leaves {1e3 * loop['rms']:.2f} mA of the current (sensor: 5 mA), where
  the gain alone leaves {1e3 * loop['rms_without']:.1f} mA.
- **Friction that grows with load**: {_share(share)}
  from turns under five loads that resist either way. A friction network of angle and speed
  cannot know it: its steady turns carry no load.
- **Presliding**: LuGre friction carries {bristle['level']:.3g} N m of the learned level and slips
  after
  {1e6 * bristle['breakaway']:.3g} urad; found on the open-loop training runs, whose mean R it
  takes from {bristle['before']:.4f} to {bristle['after']:.4f}.
"""


def _share(share: Mapping) -> str:
    return (f'{100 * share["share"]:.2f} % (± {100 * share["std"]:.2f}) of the torque that the '
            'teeth carry,') if share else 'not seen'


def _closed(found: Mapping, models: list[str]) -> str:
    loop = found['velocity_loop']
    rows = [['speed, 10 deg/s at 1 Hz (figure 12)', 'deg/s',
             *(f'{57.29578 * loop["rms"][m]:.4f} ({loop["fit"][m]:.4f})' for m in models)]]
    for way, values in found['torque'].items():
        rows.append([f'motor torque over the turn, 3 deg/s, {way} (figure 13)', 'mN m',
                     *(f'{1e3 * values["rms"][m]:.2f} ({values["fit"][m]:.4f})' for m in models)])
    for name, values in found['reversal'].items():
        rows.append([f'angle about a reversal, {name.rpartition("_")[2]} N m (figure 14)',
                     'arcmin', *(f'{values["rms"][m] / ARCMIN:.3f}' for m in models)])
    return f"""## Closed loop, as figures 12 to 14

Root mean square error of the twin under the rig's own controller and references (R of eq. 13 in
brackets). The traditional model's friction was fitted to fast open-loop motion; what it lacks over
the turn and at low speed shows here. About a reversal the angles of rig and twin are set equal in
forward motion, since where in its gap a mesh begins a run is not known.

{table(['signal', 'unit', *models], rows)}
![Speed in the velocity loop](pictures/results_velocity_loop.png)
![Motor torque over the turn](pictures/results_torque.png)
![Angle about a reversal under load](pictures/results_reversal.png)
"""


def _factors(found: Mapping) -> str:
    def scores(name: str, scale: float = 1.0) -> list[list[str]]:
        both = found[name]['forward'], found[name]['reverse']
        return [[f'{v[k] * scale ** p:.5g}' for v in both]
                for k, p in (('mse', 2), ('mae', 1))]

    load, motor = scores('friction'), scores('motor_friction', 1e3)
    mape = [[f'{found[n][w]["mape"]:.4f}' for w in ('forward', 'reverse')]
            for n in ('friction', 'motor_friction')]
    back, error = found['backlash'], found['transmission_error']
    tables = [
        table(['friction networks (table 1)', 'forward', 'reverse', 'paper'], [
            ['load: MSE, N2 m2', *load[0], '0.02673, 0.01206'],
            ['load: MAE, N m', *load[1], '0.12266, 0.08257'],
            ['load: MAPE, %', *mape[0], '0.32293, 0.18159'],
            ['motor: MSE, mN2 m2', *motor[0], ''], ['motor: MAE, mN m', *motor[1], ''],
            ['motor: MAPE, %', *mape[1], '']]),
        table(['backlash network (table 2)', 'here', 'paper'], [
            ['MSE, arcmin2', f'{back["mse"]:.3g}', '0.00003'],
            ['MAE, arcmin', f'{back["mae"]:.3g}', '0.00387'],
            ['MAPE, %', f'{back["mape"]:.3g}', '0.26261']]),
        table(['order of the turn', 'forward, arcmin', 'reverse, arcmin', 'invariance'], [
            [str(o), f'{a:.4f}', f'{b:.4f}', f'{i:.4f}'] for o, a, b, i in zip(
                error['orders'], error['forward'], error['reverse'], error['invariance'],
                strict=True)])]
    gaps = ', '.join(f'{g:.3f} at {t:.0f} N m' for g, t in zip(back['gaps'], back['loads'],
                                                               strict=True))
    return f"""## The nonlinear factors

Errors on cells of angle that were kept back. The paper's rig is another rig: its figures say what
is usual, not what is to be beaten.

{tables[0]}
![Friction over the angle](pictures/results_friction_angle.png)

{tables[1]}
Mean gap, arcmin: {gaps}.

{tables[2]}
Transmission error (eq. 12), MSE on a pass kept back: {error['mse'][0]:.3g} arcmin2 forward,
{error['mse'][1]:.3g} reverse (paper: 0.00073 and 0.00162). Invariance is 1 where amplitude and
phase of an order are the same at every speed.
"""


def _learners(found: Mapping) -> str:
    count = found['samples']
    return f"""## Learners of friction

Features of paper 003 (speed, acceleration, current; windows of 20 samples) on the friction
experiment and the open-loop training runs. There are {count['train']} windows to train,
{count['validation']} to stop by, {count['test']} to test (the last fifth of each run),
{count['beyond']} faster than any trained on. Training ends when the validation error has
stopped falling, or after {found['limit']:.0f} s. Evaluation is one call of the exported, compiled
model. Least test error: {found['best']}.

{found['table']}
![Friction over speed](pictures/results_friction_speed.png)
"""


def _emps(found: Mapping) -> str:
    names = {'symmetric_percent': 'inverse model, symmetric friction: force',
             'asymmetric_percent': 'inverse model, asymmetric friction: force',
             'position_percent': 'simulated in closed loop: position',
             'force_percent': 'simulated in closed loop: force'}
    rows = [[said, f'{found[k]:.4g}', f'{found["published"][k]:g}'] for k, said in names.items()]
    return '## EMPS\n\nRelative errors in %, beside those of the literature.\n\n' + table(
        ['error', 'here', 'published'], rows)


def _xl330(found: Mapping) -> str:
    rows = [[name.replace('_', ' '), f'{found[name]["held_out"]["all"]:.4f}',
             ', '.join(f'{n} {e:.4f}' for n, e in found[name]['held_out'].items() if n != 'all'),
             f'{published:g}'] for name, published in found['published'].items()]
    return """## XL330

Simulated position error, rad, on one-second windows of gains and trajectories not trained on.

""" + table(['friction', 'here', 'by recording', 'a quick fit elsewhere'], rows)


def _two_mass(found: Mapping) -> str:
    rows = [[name, f'{ours:.2f}', f'{truth:.2f}', f'{100 * (ours / truth - 1):+.2f}']
            for name, ours, truth in zip(('antiresonance', 'resonance'), found['fitted'],
                                         found['measured'], strict=True)]
    return """## Two masses

Hz, of the fit by output error and of the measured frequency response.

""" + table(['', 'fit', 'measured', 'difference, %'], rows)


_SECTIONS: dict[str, Callable[[Mapping], str]] = {
    'bench': _bench, 'learners': _learners, 'emps': _emps, 'xl330': _xl330,
    'two_mass': _two_mass}
