"""The chain from command to sensors, with the gap where it lies and what is missing there."""

from __future__ import annotations

from typing import Any

from .words import known, percent, ratio, spoken

CHAIN = (('command', 'controller'), ('drive', 'drive'), ('motor', 'motor'),
         ('transmission', 'transmission'), ('load', 'load'), ('sensors', 'sensor'))
"""Blocks, each with the balance that tells whether it is as modelled."""

WITHOUT_TORQUE = (*CHAIN[:2], ('motor and load', 'torque'), CHAIN[3], CHAIN[5])
"""Without a torque sensor nothing tells apart what acts on either shaft."""

SITES = {
    'motor': 'motor', 'load': 'load', 'mesh': 'transmission', 'transmission': 'transmission',
    'mechanism': 'transmission', 'drive': 'drive', 'command': 'drive', 'current': 'drive',
    'controller': 'controller',
}
"""The balance at which an effect sits, by its site."""

READINGS = ('sensor', 'encoder', 'position', 'torque', 'temperature')
"""Words in a site that stand for a sensor."""


def chain(where: list[dict[str, Any]], balance: str, which: list[dict[str, Any]]
          ) -> list[dict[str, Any]]:
    """
    Return the blocks in order: ``{block, tone, said, share, here, effects}``.

    ``tone`` is far where the verdict puts the gap, off where there is one too, fine where there is
    none, and unseen where these sensors cannot tell.
    """
    located = {one.get('balance'): one for one in where}
    merged = located.get('torque', {}).get('verdict', 'not observable') != 'not observable'
    layout = list(WITHOUT_TORQUE if merged else CHAIN)
    shown = {name for _, name in layout} | ({'motor', 'load'} if merged else {'torque'})
    layout += [(spoken(name), name) for name in located if name and name not in shown]
    seats = [(_seat(one, balance, merged), spoken(one.get('effect'))) for one in which]
    here = 'torque' if merged and balance in ('motor', 'load') else balance
    return [_block(block, name, located.get(name, {}), name == here,
                   [effect for seat, effect in seats if seat == name])
            for block, name in layout]


def _seat(one: dict[str, Any], balance: str, merged: bool) -> str:
    port, site = (one.get('mechanism') or {}).get('port', ''), str(one.get('site') or '')
    if port in ('drive', 'sensor', 'controller'):
        seat = port
    elif site in SITES:
        seat = SITES[site]
    else:
        seat = 'sensor' if any(word in site for word in READINGS) else balance
    return 'torque' if merged and seat in ('motor', 'load') else seat


def _block(block: str, name: str, one: dict[str, Any], here: bool, effects: list[str]
           ) -> dict[str, Any]:
    verdict = one.get('verdict', 'not observable')
    tone = {'gap': 'far' if here else 'off', 'at the noise floor': 'fine'}.get(verdict, 'unseen')
    said = share = ''
    if tone == 'unseen':
        said = 'not observable'
    elif known(one.get('gap_to_noise')):
        said = f'{ratio(one["gap_to_noise"])} × noise'
    if tone == 'fine':
        share = 'no gap'
    elif tone != 'unseen' and known(one.get('share')):
        share = f'{percent(one["share"])} of the gap'
    return {'block': block, 'balance': name, 'tone': tone, 'said': said, 'share': share,
            'here': here and tone != 'fine', 'effects': effects}
