"""The command `servo-identify`: each subcommand is a module of its own, imported when called."""

from __future__ import annotations

import sys

from servo_twin.cli import added_commands, dispatch

COMMANDS = {
    'init': ('.commands.init', 'look at a recording; write a servo file and a mapping file'),
    'schema': ('.commands.schema', 'print the JSON schema of servo, mapping or rig files'),
    'import': ('.commands.import_table',
               'make a bag of a table, or of each of several: CSV, Parquet, MAT, XLSX ...'),
    'info': ('.commands.info',
             'say what bags hold: duration, rate, channels, ranges, gaps, warnings'),
    'check': ('.commands.check',
              'hold recordings against a servo file: units, signs, sampling, excitation'),
    'experiment': ('.commands.experiment',
                   'drive a rig through a procedure and record its bags'),
    'fit': ('.commands.fit', 'fit parameters, or learn an effect, and write a servo file'),
    'diagnose': ('.commands.diagnose',
                 'where the gap lies, which effect causes it, how far it shrinks'),
    'online': ('.commands.online', 'replay the online estimator over a bag, and draw it'),
    'watch': ('.commands.watch', 'seconds to the alarm of each effect, false alarms an hour'),
    'play': ('.commands.play', 'measure the backlash of bags, and its curve over a setting'),
    'sinusoid': ('.commands.sinusoid',
                 'frequency and phase of a sinusoid, from a recording alone'),
    'friction': ('.commands.friction', 'learn friction by every learner and compare them'),
    'harmonic-drives': ('.commands.harmonic_drives',
                        'which of five models of a harmonic drive fits a rig'),
}
"""Subcommand: its module, which has `add_arguments(parser)` and `main(arguments)`; a summary."""


def main(argv: list[str] | None = None) -> int:
    """Run a subcommand of `servo-identify` and return its exit status."""
    return dispatch('servo-identify',
                    'Recordings, identified servo models and the gap between rig and twin.',
                    COMMANDS | added_commands('servo_identify.commands'), __package__, argv)


if __name__ == '__main__':
    sys.exit(main())
