"""
Print the JSON schema of servo, mapping or rig files, by which editors complete and judge them.

  servo-identify schema servo > servo.json

A file whose first line is `# yaml-language-server: $schema=servo.json` is known to the editor.
"""

from __future__ import annotations

import argparse
import json

from servo_twin.commands.terminal import tell

FILES = ('servo', 'mapping', 'rig')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the subcommand."""
    parser.add_argument('file', choices=FILES, help='of which files')


def main(arguments: argparse.Namespace) -> int:
    """Print the schema."""
    from servo_twin.description.shipped import shipped

    text = shipped(f'schemas/{arguments.file}.json').read_text('utf8')
    tell(arguments, schema=json.loads(text))
    print(text, end='')
    return 0
