"""
The page `docs/controllers.md`, written from what the controllers declare.

    python -m servo_twin.description.controllers_page docs/controllers.md
"""

from __future__ import annotations

import inspect

from ..physics.servo import CONTROLLERS
from ..physics.servo_parts import Controller
from .effects_page import as_markdown, parameter_rows, with_links, write_out

_HEAD = """# Controllers

The controllers that a servo file can name in `controller.type`. The mode `closed_loop` runs them,
`servo-twin linearise --input reference_position` makes them linear, and the balance `controller`
compares their command with the recorded one. This page is made from their declarations:
`python -m servo_twin.description.controllers_page docs/controllers.md`.

All are in `servo_twin/physics/controllers.py`. Each runs once a sample, over the readings of the
encoders, and its command acts until the next one. The speed filter is an exact low pass;
[signs.md](signs.md#when-a-row-is-read) says which `filter` is that of a firmware. On a linear axis
rad reads m and N m reads N. V reads A where the drive takes a current.

## On which side of the gear

References, errors and gains count at the load. A controller that reads the encoder of the motor
divides its angle by `mechanism.ratio` first, unless `on_load` is 1. So does the speed loop of
`cascade`. A firmware whose loop closes at the motor has references and gains of the motor. Divide
its references by the ratio (`scale` in the mapping), and multiply by it the gains in V s/rad and
V/rad. Gains of `impedance` are torque for angle, both at the load: multiply those of the motor by
the square of the ratio. A gain in 1/s is the same on both sides.

## How to see its error

<!-- not run: BAG is a recording of yours with its reference -->
```sh
servo-twin replay BAG --servo S.yaml --mode closed_loop
```

runs the twin with this controller under the recorded reference. Without `--mode` the recorded
command drives the twin, and no controller runs.
[twin.md](twin.md#three-ways-of-running) compares the modes.

## What is added to the command

The column `added_command` of a recording is added to the output of any controller, before its
limit. It has the unit of `voltage` and is a part of it. Two things go there: a torque that is fed
forward, and an excitation that is injected behind the controller. A torque (gravity compensation,
the `tau_ff` of a robot joint) is divided by the torque of one unit of command.

The limit comes last, because drives do it so. The torque offset of CiA 402 (60B2h) stands before
the torque limit (6072h). The firmware of robot joints limits the sum of feedback and feed-forward.
The integral of a controller stands still while this sum is at the limit.
Where the column is missing or NaN, nothing is added. The mode `measured_input` does not read it:
`voltage` holds the sum already.
"""


def page() -> str:
    """Return the page as Markdown, one section a controller."""
    return '\n'.join([_HEAD, *(_entry(name, kind) for name, kind in CONTROLLERS.items()
                               if kind.parameters)])


def _entry(name: str, kind: type[Controller]) -> str:
    return '\n'.join([f'## `{name}`\n', as_markdown(inspect.getdoc(kind)),
                      f'\nSource: {with_links(kind.source)}.\n', *parameter_rows(kind), ''])


if __name__ == '__main__':
    write_out(page())
