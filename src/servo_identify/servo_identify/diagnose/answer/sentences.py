"""The verdict as a person is told it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from ..decisions import EVEN, FORM, OPEN, SOLVED, WORTH
from ..mechanisms.hypothesis import BY_RECORDING, CLOCK, EXTERNAL, SLIP
from .report import Alternative, MissingEffect
from .sizes import listed

PLACES = {
    'drive': 'drive', 'motor': 'motor-side torque balance', 'transmission': 'transmission',
    'load': 'load-side torque balance', 'torque': 'torque balance of motor and load',
    'controller': 'controller'}
SITES = {'motor': 'motor shaft', 'load': 'load shaft', 'mesh': 'transmission',
         'command': 'command', 'drive': 'drive', 'controller': 'controller',
         'torque': 'torque sensor'}
SHOWS = {'motor': ('motor', 'torque'), 'load': ('load', 'torque'), 'mesh': ('transmission',),
         'command': ('drive',), 'drive': ('drive',), 'current': ('drive',),
         'controller': ('controller',)}
"""In which balances an effect at a site shows of itself."""

UNHELD = ('friction', 'sensor')
"""Ports at which what differs by recording is no matter of one value of the file for each."""

WORDS = {'load': 'torque of the load', 'angle': 'angle of the shaft'}
"""Variables of a pattern that a reader may take for something else."""

TORQUES = ('motor', 'load', 'torque')
"""Balances of torques."""

NOTHING: Mapping[str, float] = {}

VALUES = {'stiffness_error': 'stiffness', 'torque_constant_error': 'torque constant',
          'controller_mismatch': 'setting of the controller'}
"""Effects that are another value of the servo file, with the value."""


def sentence(status: str, which: Sequence[MissingEffect], balance: str, gap: dict[str, Any],
             unknown: dict[str, Any], late: str = '', hidden: Mapping[str, float] = NOTHING,
             rest: Mapping[str, Mapping[str, Any]] | None = None) -> str:
    """
    Return the verdict in a few sentences: place, effect, size, confidence, what remains.

    ``late`` says that the command acts after its row; without any gap that is part of the answer.
    So is ``hidden``: what equations leave, in the noise that the readings show, within what the
    servo file says of its sensors. ``rest`` is what is left of equations that are still off; see
    left_over.left_over.
    """
    place = PLACES.get(balance, balance)
    if status == 'no_gap':
        text = ('No gap: within its tolerances the twin matches the rig, down to the noise floor '
                'and the practical margin.')
        text += ''.join(
            f' But the {PLACES.get(name, name)} leaves {size:.1f} times the noise that the '
            'readings show: the servo file says more of its sensors. If that is too much, '
            'something is missing there.' for name, size in hidden.items())
        off, floor = gap.get('within_tolerance', 0.0), gap.get('floor', 0.0)
        if off > max(FORM, OPEN * floor):
            text += (f' But the simulation is off by {100.0 * off:.0f} % of what the channels '
                     f'move, where noise makes {100.0 * floor:.0f} %: small errors add up there. '
                     'Friction at rest may be among them: slow starts from rest show it.')
        return f'{text} But {late}.' if late else text
    if not which:
        text = f'The {place} does not match the rig, and no effect of the list explains it.'
        if unknown.get('depends_on'):
            text += f' What is missing {_pattern(unknown)}'
        text += unknown.get('recordings', '')
        if unknown.get('nearest'):
            several = [spoken(one['effect']) for one in unknown['nearest']]
            text += (f' {listed(several).capitalize()} would come nearest, but no nearer than '
                     'chance does on so few data.')
        return text + _left(rest, balance, unknown)
    # what shows most in a balance may act at another place
    if not all(balance in SHOWS.get(one.site, (balance,)) for one in which):
        place = 'twin'
    there = [_named(one).removesuffix(f' at the {place}') for one in which]
    several = [f'{name} ({one.change})' if one.change else name
               for one, name in zip(which, there, strict=True)]
    first = which[0]
    several_at = Counter(one.effect for one in first.alternatives)
    others = [f'the same at the {SITES.get(one.site, one.site)}' if one.effect == first.effect
              else _named(one) if several_at[one.effect] > 1 else spoken(one.effect)
              for one in first.alternatives]
    unsure = first.rung == 'place' and others
    perhaps = f', or perhaps {listed(others, "or")}' if unsure else ''  # only its place is known
    if not _is_value(first.effect):
        several[0] += perhaps
    lacks, differs = ([text for one, text in zip(which, several, strict=True)
                       if _is_value(one.effect) == value] for value in (False, True))
    said = [f'{place} is missing {listed(lacks)}'] if lacks else []
    has = 'rig' if lacks or place == 'twin' else place  # the twin has what the file says
    said += [f'{has} has {listed(differs)} than the servo file'
             f'{perhaps if _is_value(first.effect) else ""}'] if differs else []
    text = f'The {", and the ".join(said)}.'
    if unknown.get('depends_on'):
        text += f' What else is missing has no name in the list. It {_pattern(unknown)}'
        text += ' The new file holds it as a curve.' if unknown.get('held') else ''
    gone = round(100.0 * gap['shrink'])
    it = 'it' if len(which) == 1 and not unknown.get('held') else 'them'
    it = f'Adding {it}' if lacks else f'Taking {it} over'
    apart = [one for one in which if _remedy(one)]
    if len(apart) == len(which):
        if all(one.effect == EXTERNAL or one.mechanism['port'] in UNHELD for one in which):
            text += f' No effect of a twin can hold {"it" if len(which) == 1 else "them"}.'
    elif gone > 0:
        text += f' {it} removes {gone} % of the error on unseen recordings.'
    else:
        closed = round(100.0 * gap.get('equation_solved', 0.0))
        text += (f' {it} removes {closed} % of what the {PLACES.get(balance, balance)} is off by, '
                 'but alone it' if closed > 0 else f' {it} alone')
        text += (' does not reduce the error of the simulation on unseen recordings: the servo '
                 'file stays as given.')
    text += ''.join(f' {remedy}' for remedy in dict.fromkeys(map(_remedy, apart)))
    least = min(which, key=lambda one: one.confidence['mechanism'])
    text += f' Confidence: {round(100.0 * least.confidence["mechanism"])} %.'
    if least.named_in <= EVEN:  # what else could stand there is said below
        whose = '' if len(which) == 1 else f' {spoken(least.effect)}'
        text += (f' Searched by halves, {round(100.0 * least.named_in)} % of them name'
                 f'{whose or " it"}: more recordings would make it surer.')
    if unsure:
        text += ' These recordings do not tell which.'
    elif others:
        text += f' These recordings do not exclude {listed(others, "or")}.'
    if status != 'explained' and len(apart) < len(which):
        refitted = gap.get('refitted_solved', 0.0)
        left = f'{round(100.0 * (1.0 - gap["solved"]))} %'
        if gone <= 0 and refitted - gap['solved'] > WORTH:
            text += (' With other values moved within their tolerances as well, '
                     f'{round(100.0 * refitted)} % is removed (--refit).')
        elif refitted >= SOLVED > gap['solved'] and not rest:
            text += (f' Much of the other {left} is within the tolerances of the servo file: '
                     f'where its values move too, {round(100.0 * refitted)} % is removed '
                     '(--refit).')
        else:
            text += f' {left} of the error remains.' if gone > 0 and left != '0 %' else ''
            if refitted - gap['solved'] > WORTH:
                text += (f' Moving other values within their tolerances as well would remove '
                         f'{round(100.0 * refitted)} % (--refit).')
    text += _left(rest, balance, unknown)
    within = gap.get('within_solved', 0.0)
    if len(apart) < len(which) and within > WORTH + max(
            gap['solved'], gap.get('refitted_solved', 0.0)):
        text += (f' Values of the file moved within their tolerances remove more without '
                 f'{"it" if len(which) == 1 else "them"}: {round(100.0 * within)} %.')
    return text


def _pattern(unknown: dict[str, Any]) -> str:
    """Say what a pattern without a name depends on, and its size."""
    over = ' and '.join(WORDS.get(one, one) for one in unknown['depends_on'])
    return (f'depends on the {over} and is {unknown["parity"]} in the direction of motion.'
            + (f' Its size is {unknown["size"]}.' if unknown.get('size') else ''))


def _left(rest: Mapping[str, Mapping[str, Any]] | None, balance: str,
          unknown: dict[str, Any]) -> str:
    """
    Say what is left of the equations that are still off, where no pattern was found in it.

    Where the ``balance`` at fault is one of them, the others follow from it.
    """
    if not rest or unknown.get('depends_on'):
        return ''
    rest = {balance: rest[balance]} if balance in rest else rest
    several = [f'{one["rms"]:.2g} {one["unit"]} of the {PLACES.get(name, name)}, changing within '
               f'{one["seconds"]:.2g} s' for name, one in rest.items()]
    text = f' What is left follows nothing that was recorded: {listed(several)}.'
    return text + (' A torque from outside does that, as wind or a hand, or a law that the list '
                   'lacks.' if any(name in TORQUES for name in rest) else '')


def _of_controller(one: MissingEffect) -> str:
    """Return what to do about a controller: no setting of its law does what another law does."""
    if not one.parameters:
        return 'No controller of a twin has that.'
    if one.shrink_realised >= SOLVED:
        return 'Set the controller of the servo file so.'
    return (f'This setting takes {round(100.0 * one.shrink_realised)} % of what the controller '
            'deviates from its law, so that it is not the cause by itself. Look for a '
            'feed-forward in the firmware, or for a command added behind the controller '
            '(added_command).')


def _remedy(one: MissingEffect) -> str:
    """Return what to do about what no effect of a twin can hold; '' of others."""
    if one.effect == EXTERNAL:
        return f'Measured or computed, it comes in as the column {EXTERNAL}.'
    if one.effect == CLOCK:
        return f'Bring the {one.site} to the time of the other channels before it is compared.'
    if one.effect == SLIP:
        return ('A twin cannot know what has slipped before: tighten the belt, the rope or the '
                'clutch, or close the loop over the encoder of the load.')
    if one.added:  # a wave behind the controller
        return 'Record it as the column added_command, and it counts as part of the loop.'
    if one.site == 'controller':
        return (f'{_of_controller(one)} The comparison by simulation runs under the recorded '
                'command and does not show it.')
    if one.mechanism['driving']:
        return (f'The {one.site} drives the twin: take the filter off it, or log it without, '
                'before it is simulated.')
    if BY_RECORDING not in one.mechanism['variables']:
        return ''
    if one.mechanism['port'] == 'sensor':
        return f'Take the zero of the {one.site} before each recording.'
    if one.mechanism['port'] in ('torque', 'inertia'):
        return ('One servo file has one load: diagnose the recordings with another on their own, '
                'each with its file.' + (
                    ' Wind or a hand pushes so too: record it as external_torque.'
                    if one.effect == 'constant_torque' else ''))
    if one.mechanism['port'] == 'clearance':
        return ('Teeth that wear or a fastening that works loose do that: diagnose the recordings '
                'on their own, each with its file.')
    return ('Look for what differs between them, as a machine that warms up, a supply that sags '
            'or a brake that drags; where it is warmth, record the temperature.')


def _is_value(effect: str) -> bool:
    """Tell whether an effect is another value of the servo file, and nothing is missing."""
    return effect.startswith('parameter:') or effect in VALUES


def spoken(effect: str) -> str:
    """Return the name of an effect in words."""
    if effect in VALUES:
        return f'another {VALUES[effect]}'
    if effect.startswith('parameter:'):
        instance, _, value = effect.removeprefix('parameter:').rpartition('.')
        value = f'another value of {value.replace("_", " ")}'
        return f'{value} of {instance.replace("_", " ")}' if instance else value
    return effect.replace('_', ' ')


def _named(one: MissingEffect | Alternative) -> str:
    if _is_value(one.effect):
        text = spoken(one.effect)
        if isinstance(one, MissingEffect) and '.' not in one.effect and (
                'angle' in one.mechanism['variables'][1:]):
            where = 'place' if (one.curve or {}).get('unit') == 'm' else 'angle'
            text += f' at each {where} of the {"motor" if one.site == "motor" else "load"}'
        return text
    return at_its_place(one.effect, one.site)


def at_its_place(effect: str, site: str) -> str:
    """Return the name of an effect with where it acts, in words."""
    return f'{spoken(effect)} at the {SITES.get(site, site.replace("_", " "))}'
