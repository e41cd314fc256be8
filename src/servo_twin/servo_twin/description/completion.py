"""Scripts that complete the commands in bash and zsh, made from what the commands declare."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence

from ..physics.servo import ServoError
from .shipped import shipped_servos

SHELLS = ('bash', 'zsh')
_BASH = """# Completion of {program}: eval "$({program} --completion {which})"
{begin}_{name}() {{
  local word="${{COMP_WORDS[COMP_CWORD]}}" before="${{COMP_WORDS[COMP_CWORD-1]}}" words=""
  if [ "$COMP_CWORD" -eq 1 ]; then
    words="{commands} --help --version --completion"
  else
    case "${{COMP_WORDS[1]}} $before" in
{choices}
    esac
    if [ -z "$words" ] && [ "${{word#-}}" != "$word" ]; then
      case "${{COMP_WORDS[1]}}" in
{options}
      esac
    fi
  fi
  COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o default -F _{name} {program}
"""


_ZSH = """autoload -Uz compinit bashcompinit
(( $+functions[compdef] )) || compinit -u
bashcompinit
"""


def script(program: str, parsers: Mapping[str, argparse.ArgumentParser], asked: Sequence[str]
           ) -> str:
    """Return the script for the shell that is asked for; raises SystemExit (2) for another."""
    if list(asked) not in [[shell] for shell in SHELLS]:
        raise SystemExit(f'{program} --completion: name one of {list(SHELLS)}')
    choices, options = [], []
    for command, parser in parsers.items():
        names = [name for action in parser._actions for name in action.option_strings]
        options.append(f'        {command}) words="{" ".join(names)}" ;;')
        for action in parser._actions:
            known = _known(action)
            if known:
                for name in action.option_strings:
                    choices.append(f'      "{command} {name}") words="{" ".join(known)}" ;;')
    begin = _ZSH if asked[0] == 'zsh' else ''
    return _BASH.format(program=program, which=asked[0], begin=begin,
                        name=program.replace('-', '_'), commands=' '.join(parsers),
                        choices='\n'.join(choices), options='\n'.join(options))


def _known(action: argparse.Action) -> list[str]:
    """Return what can stand behind an option; nothing where it is a file."""
    if '--servo' in action.option_strings:
        try:
            return shipped_servos()
        except ServoError:
            return []
    return [str(one) for one in action.choices or ()]
