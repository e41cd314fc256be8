"""
Learn friction from bags by every learner, and compare them.

Writes into the output folder table.md and table.json, the learners of paper 003 and the classical
laws on the same splits, and friction_speed.png. Where the bags hold steady turns in both
directions, it also writes network.json with the figures of paper 000 table 1, friction_angle.png,
and servo.yaml, the servo with the learned friction.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
import sys

from servo_twin.commands.terminal import new_folder, say, tell, terminal
from servo_twin.commands.terminal import plain as nulled

from ..data.arguments import add_data, files
from ..data.arguments import recordings as read
from ..learn.friction.friction_features import FEATURES
from ..learn.friction.learners import lacking, names


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    add_data(parser)
    parser.add_argument('--unseen', nargs='+', metavar='BAG', default=[],
                        help='bags that nothing is trained on, to judge every learner by')
    parser.add_argument('--without', nargs='+', choices=FEATURES, default=[],
                        help='features that the learners shall not be given; without a torque '
                        'sensor friction is a sum of current and acceleration')
    parser.add_argument('-o', '--output', type=Path, required=True, help='folder to write to')
    parser.add_argument('--learners', nargs='+', choices=names(), default=[],
                        help='default: all whose libraries are installed')
    parser.add_argument('--site', choices=('load', 'motor'), default='load')
    parser.add_argument('--seconds', type=float, default=60.0,
                        help='of the processor at most, for each learner')
    parser.add_argument('--cells', type=int, default=360,
                        help='equal angles of the turn that friction is resampled to')
    parser.add_argument('--seed', type=int, default=0)


def main(arguments: argparse.Namespace) -> int:
    """Learn, compare, draw, write."""

    from servo_twin.description import servo_file

    from ..learn.friction.friction_dataset import dataset_of
    from ..learn.friction.friction_samples import friction_of
    from ..learn.friction.learner_comparison import best_of, compared, markdown, plain

    chosen = arguments.learners or [name for name in names() if not lacking(name)]
    if not arguments.learners and len(chosen) < len(names()):
        print(f'left out, since a library is missing: '
              f'{", ".join(name for name in names() if name not in chosen)}', file=sys.stderr)
    servo = servo_file.load(arguments.servo)
    files([*arguments.bags, *arguments.unseen])
    new_folder(arguments.output, arguments.force, 'table.md', 'table.json', 'servo.yaml')
    recordings, unseen = read(arguments), read(arguments, arguments.unseen)
    samples = friction_of(servo, [*recordings, *unseen], arguments.site)
    data = dataset_of(samples, without=arguments.without, unseen=range(
        len(recordings), len(recordings) + len(unseen)))
    console = terminal(stderr=True, quiet=arguments.quiet)
    with console.status('learning') as status:
        def told(name: str, epoch: int, loss: float, held: float) -> None:
            status.update(f'{name}: epoch {epoch}, loss {loss:.4g}, validation {held:.4g}')

        rows, models = compared(data, chosen, seed=arguments.seed,
                                seconds=arguments.seconds, told=told)
    (arguments.output / 'table.md').write_text(markdown(rows))
    (arguments.output / 'table.json').write_text(
        json.dumps(nulled(plain(rows)), indent=1, allow_nan=False) + '\n')
    from ..learn.friction.friction_plots import friction_speed
    friction_speed(data, models, arguments.output / 'friction_speed.png')
    tell(arguments, learners=plain(rows), best=best_of(rows).name, written=[arguments.output])
    say(arguments, markdown(rows).rstrip('\n'), f'smallest error: {best_of(rows).name}')
    _paper_network(servo, recordings, arguments)
    return 0


def _paper_network(servo, recordings, arguments: argparse.Namespace) -> None:
    from servo_twin.description import servo_file

    from ..learn.friction.friction_plots import friction_angle
    from ..learn.friction.servo_friction import learned_friction, with_friction

    try:
        learned = learned_friction(servo, recordings, arguments.site, seed=arguments.seed,
                                   cells=arguments.cells)
    except ValueError as problem:
        print(f'no network of paper 000: {problem}', file=sys.stderr)
        return
    scores = {'forward': vars(learned.forward_scores), 'reverse': vars(learned.reverse_scores)}
    (arguments.output / 'network.json').write_text(
        json.dumps(nulled(scores), indent=1, allow_nan=False) + '\n')
    friction_angle(learned, arguments.output / 'friction_angle.png')
    servo_file.save(with_friction(servo, learned), arguments.output / 'servo.yaml')
    for way, s in scores.items():
        say(arguments, f"{way}: MSE {s['mse']:.5f} N2 m2, MAE {s['mae']:.5f} N m, "
            f"MAPE {s['mape']:.3f} %")
