"""The command `servo-identify`: each subcommand is a module of its own, imported when called."""

from __future__ import annotations

import sys

from servo_twin.cli import dispatch

COMMANDS = {
    'import': ('.importing', 'make a bag of a table: CSV, Parquet, or MAT and JSON by a mapping'),
    'info': ('.info', 'say what bags hold: duration, rate, channels, ranges, gaps, warnings'),
    'experiment': ('.experiment.command', 'drive a rig through a procedure and record its bags'),
    'diagnose': ('.gap.command', 'where the gap lies, which effect causes it, how far it shrinks'),
    'online': ('.online.command', 'replay the online estimator over a bag, and draw it'),
    'play': ('.transmission.play_command', 'play of bags, and its curve over a setting'),
    'sinusoid': ('.sinusoid.command', 'frequency and phase of a sinusoid, from a recording alone'),
    'watch': ('.watching.command', 'seconds to the alarm of each effect, false alarms an hour'),
    'fit': ('.fitting.command', 'fit parameters, or learn an effect, and write a servo file'),
    'harmonic-drives': ('.harmonic_drives', 'which of five models of a harmonic drive fits a rig'),
    'friction': ('.friction.command', 'learn friction by every learner and compare them'),
    'results': ('.results.command', 'the models of paper 000 compared, learners, real machines'),
    'blind-check': ('.blind.command', 'score the diagnosis on rigs with effects withheld'),
}
"""Subcommand: its module, which has `add_arguments(parser)` and `main(arguments)`; a summary."""


def main(argv: list[str] | None = None) -> int:
    """Run a subcommand of `servo-identify` and return its exit status."""
    return dispatch('servo-identify',
                    'Recordings, identified servo models and the gap between rig and twin.',
                    COMMANDS, __package__, argv)


if __name__ == '__main__':
    sys.exit(main())
