"""
The page `docs/servo_file.md`, written from what drives, mechanisms and sensors declare.

    python -m servo_twin.description.servo_file_page docs/servo_file.md
"""

from __future__ import annotations

import inspect

from ..physics.servo import DRIVES, MECHANISMS, SENSORS
from ..physics.servo_parts import Part
from .effects_page import as_markdown, parameter_rows, with_links, write_out
from .given_values import required

_HEAD = """# The servo file

A servo file describes one machine in YAML. The twin runs it, a fit and a diagnosis change it. This
page is made from the declarations:
`python -m servo_twin.description.servo_file_page docs/servo_file.md`.

```yaml
servo: my_machine               # its name
travel: rotary                  # linear: the load is in m, N and kg, the ratio in rad/m
step: 5.0e-5                    # s, longest step of the integration

drive: {type: voltage}          # with its values, see below
mechanism: {type: two_inertia}
controller: {type: none}        # see controllers.md
observer: {bandwidth: 60.0}     # rad/s, of the mode `observer`; 0 is off
sensors:
  motor_encoder: {noise: {value: 9.4e-4, unit: rad, source: one count / sqrt(12)}}
effects:                        # see effects.md; any number, each with a name of yours
  bearing: {effect: coulomb_friction, at: load, level: {value: 0.025, source: data sheet}}
tolerance:                      # how far a value may be off: a share, or a range
  drive.resistance: 8 %
  effects.bearing.level: [0.01, 0.04]
  effects.gear.cosine: 10 %     # of a row: each of its numbers that is not zero
  effects.gear.sine[0]: [0, 1e-4]   # or one of them, counted from 0
```

A value is a number, or a mapping:

| key | meaning |
|---|---|
| `value` | the number, in the unit of the tables below |
| `unit` | said once more, so that a wrong one is refused |
| `source` | where it comes from: data sheet, measurement, estimate |
| `std` | its standard error; a fit writes it |
| `bags` | the recordings that it was fitted to; a fit writes them |

On a linear axis (`travel: linear`) the tables below are read so: what belongs to the load and the
transmission has m for rad, N for N m, kg for kg m2. The ratio of a motor that turns is in rad/m,
and its own side stays as it is. A linear motor has a ratio of 1 without unit, and all its values
are in m, N and kg. [signs.md](signs.md#a-linear-axis) has a table of both. When a reading is taken
and how a controller filters, [signs.md](signs.md#when-a-row-is-read) says.

What is marked *must be given* has no default: a file without it is refused by name. Other defaults
are listed where they were taken, but for what is so by nature, such as gravity once a turn. A key
that is not known is refused with the choice.
`servo-twin parameters NAME` prints the same for one file or effect.

`harmonic_drive: {model: NAME}` stands for the effects of one of five models; see
[pan_tilt.md](pan_tilt.md). A mechanism `fmu` runs a model from elsewhere; see [fmu.md](fmu.md).
"""


def page() -> str:
    """Return the page as Markdown: one section a kind of part, one entry a type."""
    sections = [_HEAD]
    for title, key, parts in (('Drives', 'drive.type', DRIVES),
                              ('Mechanisms', 'mechanism.type', MECHANISMS),
                              ('Sensors', 'sensors', SENSORS)):
        more = ' A sensor that the machine lacks is left out.' if key == 'sensors' else ''
        sections.append(f'## {title}\n\nKey: `{key}`.{more}\n')
        sections += [_entry(name, part) for name, part in parts.items()]
    sections.append('## Controllers and effects\n\n[controllers.md](controllers.md) and '
                    '[effects.md](effects.md) list them.\n')
    return '\n'.join(sections)


def _entry(name: str, part: type[Part]) -> str:
    needed = required(part)
    rows = [f'{row} must be given |' if row.split('`')[1] in needed else f'{row} |'
            for row in parameter_rows(part)[2:]]
    table = ['| parameter | default | unit | bounds | off | meaning | |',
             '|---|---|---|---|---|---|---|', *rows] if rows else []
    return '\n'.join([f'### `{name}`\n', as_markdown(inspect.getdoc(part) or ''),
                      f'\nSource: {with_links(part.source)}.\n', *table, ''])


if __name__ == '__main__':
    write_out(page())
