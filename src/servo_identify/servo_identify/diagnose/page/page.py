"""The page of a diagnosis, made of its document: one HTML file that needs no network."""

from __future__ import annotations

from base64 import b64encode
from functools import cache
from hashlib import sha256
from importlib.resources import files
import json
from math import isfinite
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup

from servo_twin.description.whole_file import write_whole
from servo_twin.pages.plotting import COLOURS, LICENCE, plotting, STYLE
from servo_twin.pages.plotting import SCRIPTS as SHARED

from . import page_tables as tables
from .causes import causes
from .chain import chain
from .packed_series import packed_equation, packed_series
from .words import between, known, percent, spoken, unbroken

STATUS = {'no_gap': 'no gap', 'explained': 'gap explained',
          'partly_explained': 'gap explained in part', 'unknown': 'cause unknown'}
SCRIPTS = ('curve.js', 'time_plots.js', 'overview.js', 'page.js')
DIGITS = 6  # of a curve that is drawn


def write_page(document: dict[str, Any], path: Path | str) -> Path:
    """Write the page of a diagnosis and return its path."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, page_of(document))
    return path


def page_of(document: dict[str, Any]) -> str:
    """
    Return the page as HTML that refers to nothing outside itself.

    ``document`` is plain JSON: report (report.json), series, equations, correlations, patch and
    facts. What is empty or missing is left out of the page.
    """
    report = document.get('report') or {}
    scripts = [*map(plotting, SHARED), *map(_asset, SCRIPTS)]
    return _template().render(
        **_head(report), **_body(report),
        patch=(document.get('patch') or '').splitlines(),
        heat=tables.heat_map(document.get('correlations') or {}),
        facts=tables.made_by(document.get('facts') or {}),
        signals=bool(document.get('series') or document.get('equations')),
        data=_data(document, report),
        style=Markup('\n'.join((plotting(STYLE), plotting(COLOURS), _asset('page.css')))),
        scripts=[Markup(script) for script in scripts], policy=_policy(scripts),
        licence=Markup(plotting(LICENCE)), spoken=spoken)


def _head(report: dict[str, Any]) -> dict[str, Any]:
    verdict, gap = report.get('verdict') or {}, report.get('gap') or {}
    status = verdict.get('status')
    if status not in STATUS:
        raise ValueError(f'report.verdict.status = {status!r} is not one of {list(STATUS)}')
    facts = {'servo': spoken(report.get('servo'))} if report.get('servo') else {}
    given = gap.get('as_given', gap.get('before'))
    if known(given):
        facts['gap as given'] = percent(given, 3) + ' of the signal'
    if known(gap.get('after')) and _added(report):
        facts['augmented'] = percent(gap['after'], 3)
    if known(gap.get('floor')):
        facts['noise'] = percent(gap['floor'], 3)
    if known(gap.get('shrink')) and _added(report):
        inside = between(gap.get('interval'))
        facts['gone of what is above the noise, on unseen recordings'] = percent(
            gap['shrink']) + (f' (90 % interval: {inside})' if inside else '')
    stability = report.get('stability') or {}
    return {
        'status': status, 'badge': STATUS[status], 'servo': spoken(report.get('servo')),
        'sentence': verdict.get('sentence') or STATUS[status].capitalize() + '.',
        'remains': verdict.get('remains') or '', 'head_facts': facts,
        'splits': stability.get('splits'),
        'named_in': _named_in(stability.get('named_in')),
    }


def _body(report: dict[str, Any]) -> dict[str, Any]:
    which = report.get('which') or []
    balance = (report.get('verdict') or {}).get('balance') or ''
    return {
        'blocks': chain(report.get('where') or [], balance, which)
        if report.get('where') else [],
        'causes': causes(which),
        'gap_bars': tables.gap_bars(report.get('gap') or {}, _added(report)),
        'channels': tables.channel_table(report.get('channels') or {}, _added(report)),
        'moved': tables.moved_rows(report.get('moved') or []),
        'defaults': tables.default_rows(report.get('defaults') or []),
        'equations': tables.equation_rows(report.get('equations') or {}),
        'findings': tables.sorted_findings(report.get('findings') or []),
        'experiment': tables.experiment(report.get('next_experiment') or {}),
        'confirm': report.get('confirm') or [], 'warnings': report.get('warnings') or [],
        'unknown': tables.unknown_lines(report.get('unknown') or {}),
        'recordings': tables.recording_rows(report.get('recordings') or {}),
        'timing': tables.timing_rows(report.get('timing') or {}),
    }


def _added(report: dict[str, Any]) -> bool:
    """Tell whether the servo file gets anything of what was found: else it stays as given."""
    gap = report.get('gap') or {}
    return bool(report.get('which')) and gap.get('after') != gap.get('before')


def _named_in(named: object) -> list[tuple[str, str]]:
    if isinstance(named, dict):
        return [(spoken(name), percent(share)) for name, share in named.items()]
    return [('', percent(named))] if known(named) else []


def _data(document: dict[str, Any], report: dict[str, Any]) -> Markup:
    """Return what the plots are drawn of as JSON that can stand in a script element."""
    kept = {
        'series': [packed_series(one) for one in document.get('series') or []],
        'equations': [packed_equation(one) for one in document.get('equations') or []],
        'curves': [{'curve': _rounded(one.get('curve')), 'points': _rounded(one.get('points'))}
                   for one in report.get('which') or []],
    }
    text = json.dumps(kept, separators=(',', ':'), allow_nan=False)
    for sign in '<>&':
        text = text.replace(sign, f'\\u{ord(sign):04x}')
    return Markup(text)


def _rounded(thing: Any) -> Any:
    if isinstance(thing, float):
        return float(f'{thing:.{DIGITS}g}') if isfinite(thing) else None
    if isinstance(thing, dict):
        return {name: _rounded(value) for name, value in thing.items()}
    if isinstance(thing, (list, tuple)):
        return [_rounded(value) for value in thing]
    return thing


@cache
def _template() -> Template:
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True,
                              lstrip_blocks=True)
    environment.filters['unbroken'] = unbroken
    return environment.from_string(_asset('page.html'))


def _asset(name: str) -> str:
    return files(__package__).joinpath(name).read_text('utf8')


def _policy(scripts: list[str]) -> str:
    """Return a content security policy under which nothing runs but these, and nothing loads."""
    sums = ' '.join("'sha256-" + b64encode(sha256(s.encode()).digest()).decode() + "'"
                    for s in scripts)
    return (f"default-src 'none'; script-src {sums}; style-src 'unsafe-inline'; "
            "img-src data:; base-uri 'none'; form-action 'none'")
