"""The report of a soak: a table of promises, one row a fault, and a drawn time line."""

from __future__ import annotations

from collections import defaultdict
from html import escape
from statistics import quantiles

import quiet
import tasks

UNWELL = 0.5  # s, beside the time by which it is seen
SEEN = 10.0  # s behind a fault in which the detector may name it: its longest window is 8 s
CALM = 60.0  # s without faults from which on its silence says something
COLOURS = {'wire': '#2a6f97', 'KILL': '#b5179e', 'TERM': '#7209b7', 'STOP': '#f77f00',
           'odd': '#6a994e', 'clock': '#bc6c25', 'memory': '#386641'}


def text(figures: dict) -> tuple[str, bool]:
    """Return the report as Markdown, and whether a promise was broken."""
    rows, bags = figures['rows'], figures['bags']
    alone = [row for row in rows if row['alone']]
    zero = [row['zero'] for row in alone if row['zero_due'] and row['zero'] is not None]
    named = [row['named'][0] for row in alone if row['named']]
    recovered = [row['well'] - row['cured'] for row in rows
                 if row['well'] and not row.get('by_hand')]
    by_hand = sum(bool(row.get('by_hand')) for row in rows)
    unwell = sum(row['well'] is None for row in rows)
    promises = [
        ('samples lost and not told', f'{len(bags["untold"])} places among {bags["samples"]} '
         f'samples in {bags["read"]} bags; {bags["missing"]} lost ones are told by the running '
         f'number, {len(bags["elsewhere"])} of {bags["holes"]} times outside any fault',
         not bags['untold']),
        ('set-points older than `command_timeout` (0.1 s, and 3 ms by which a value tells it) at '
         'a drive with torque',
         f'{len(figures["stale"])} of {figures["commands"]}; the oldest '
         f'{1e3 * figures["oldest"]:.0f} ms; {figures["powerless"]} at a drive whose watchdog had '
         f'taken the torque away', not figures['stale']),
        ('set-points beyond the limit of the driver', f'{len(figures["beyond"])}',
         not figures['beyond']),
        ('from a fault to no torque', _spread(zero), True),
        ('from a fault to its name on `/diagnostics`', _spread(named), True),
        ('well again by itself after the cause is gone', f'{_spread(recovered)}; by hand, as the '
         f'driver asks: {by_hand}; not at all: {unwell}', unwell == 0),
        ('bags that cannot be read', f'{len(bags["unreadable"])} of {bags["bags"]} '
         f'({bags["empty"]} without a sample yet)', not bags['unreadable']),
        ('replay of the last bag against what the twin said live, parameter changes included',
         f'{sum(same for _, same, _ in figures["replays"])} of '
         f'{len(figures["replays"])} alike to the last bit',
         all(same for _, same, _ in figures['replays'])),
        ('stack traces in the logs', str(len(figures['traces'])), not figures['traces']),
        ("ends with another status than the signal's", ', '.join(figures['ends']) or '0',
         not figures['ends']),
        ('changes named by the detector where there was none', *_changes(figures)),
        *quiet.judged(figures['quiet']),
        *tasks.judged(figures['tasks']),
        ('processes killed at the end, or left', f'{len(figures["killed"])}, '
         f'{len(figures["left"])}', not figures['killed'] and not figures['left']),
    ]
    if figures['beside']:
        ill = [row['beside'] for row in rows if row['beside'] is not None]
        holes = [said for one in figures['beside'] for said in one['elsewhere']]
        untold = [said for one in figures['beside'] for said in one['untold']]
        promises.append((
            'the rigs beside it stay well while a fault is that of one rig',
            f'{sum(one > UNWELL for one in ill)} of {len(ill)} faults left one without samples, '
            f'predictions or set-points for more than {UNWELL:g} s, the longest for '
            f'{max(ill, default=0.0):.2f} s; samples missing {len(holes)} times among '
            f'{sum(one["samples"] for one in figures["beside"])}, {len(untold)} times untold',
            not untold and max(ill, default=0.0) <= UNWELL))
    lines = [f'{figures["seconds"] / 60.0:.0f} minutes, seed {figures["seed"]}, {len(rows)} times '
             f'one fault or two.', '', '| promise | seen | |', '|---|---|---|']
    words = {True: 'kept', False: '**missed**', None: 'not judged'}
    lines += [f'| {name} | {seen} | {words[kept]} |' for name, seen, kept in promises]
    lines += ['', '| fault, alone | times | no torque after, s | named after, s | '
              'well again after, s |',
              '|---|---|---|---|---|']
    by_name = defaultdict(list)
    for row in alone:
        by_name[row['faults'][0]].append(row)
    for name, those in sorted(by_name.items()):
        lines.append(f'| {name} | {len(those)} | {_most([r["zero"] for r in those])} | '
                     f'{_most([r["named"] and r["named"][0] for r in those])} | '
                     f'{_most([r["well"] and r["well"] - r["cured"] for r in those])}'
                     f'{" by hand" if any(r.get("by_hand") for r in those) else ""} |')
    lines += ['', '| process, its longest life | minutes | MiB an hour | threads | files |',
              '|---|---|---|---|---|']
    longest = {}
    for one in figures['slopes']:
        if one[1] > longest.get(one[0], (0, 0.0))[1]:
            longest[one[0]] = one
    lines += [f'| {name} | {minutes:.1f} | {slope:+.1f} | {threads:+d} | {files:+d} |'
              for name, minutes, slope, threads, files in sorted(longest.values())]
    told = [*figures['misses'], *bags['untold'][:20], *bags['unreadable'],
            *(f'replay of {name}: {said}' for name, same, said in figures['replays'] if not same),
            *(f'left: {one}' for one in figures['left']),
            *(f'killed at the end: {one}' for one in figures['killed']),
            *(f'trace of {one}' for one in figures['traces'])]
    if told:
        lines += ['', 'Misses:', '', *(f'- {one}' for one in told)]
    return '\n'.join(lines) + '\n', bool(told) or any(kept is False for *_, kept in promises)


def _spread(values: list[float]) -> str:
    if not values:
        return 'none'
    if len(values) < 2:
        return f'{values[0]:.2f} s, once'
    cuts = quantiles(values, n=100, method='inclusive')
    return (f'median {cuts[49]:.2f} s, p99 {cuts[98]:.2f} s, most {max(values):.2f} s of '
            f'{len(values)}')


def _most(values: list) -> str:
    known = [value for value in values if value is not None]
    return f'{max(known):.2f}' if known else ''


def _changes(figures: dict) -> tuple[str, bool | None]:
    """Return what the detector named outside of faults, and whether that is as promised."""
    rows, events = figures['rows'], figures['events']
    busy = sorted([(row['at'], (row['well'] or row['cured']) + SEEN) for row in rows]
                  + [(row['begin'], row['begin'] + SEEN) for row in figures['quiet']]
                  + [(row['end'], row['over'] + SEEN) for row in figures['quiet']])
    calm = sum(max(0.0, after[0] - max(end for _, end in busy[:k + 1]))
               for k, after in enumerate(busy[1:]))
    last = busy[-1][1] if busy else 0.0  # then the twin is restarted, and its values are changed
    outside = [at for at, *_ in events
               if at < last and not any(begin <= at <= end for begin, end in busy)]
    return (f'{len(outside)} in {calm:.0f} s that were {SEEN:g} s and more after a fault; '
            f'{len(events) - len(outside)} in the rest, where something had happened',
            False if outside else None if calm < CALM else True)


def time_line(figures: dict) -> str:
    """Return the faults and what came of them as SVG: a bar each, from the fault to well again."""
    rows = figures['rows']
    begin, end = rows[0]['at'], max((row['well'] or row['cured']) for row in rows)
    names = sorted({name for row in rows for name in row['faults']})
    wide, left, high = 1100.0, 210.0, 14.0

    def x(at: float) -> float:
        return left + (wide - left - 10.0) * (at - begin) / max(1.0, end - begin)

    parts = []
    for k, name in enumerate(names):
        y = 8.0 + high * k
        parts.append(f'<text x="{left - 6}" y="{y + 9}" text-anchor="end">{escape(name)}</text>'
                     f'<line x1="{left}" x2="{wide}" y1="{y + 5}" y2="{y + 5}" stroke="#eee"/>')
        colour = next((c for word, c in COLOURS.items() if word in name), '#555')
        for row in rows:
            if name in row['faults']:
                well = row['well'] or row['cured'] + 40.0
                title = (f'{name} at {row["at"] - begin:.0f} s, '
                         f'well after {well - row["cured"]:.1f} s')
                parts.append(
                    f'<g><title>{escape(title)}</title>'
                    f'<rect x="{x(row["cured"]):.1f}" y="{y + 2}" height="6" fill="{colour}" '
                    f'opacity="0.3" width="{max(1.0, x(well) - x(row["cured"])):.1f}"/>'
                    f'<rect x="{x(row["at"]):.1f}" y="{y}" height="10" fill="{colour}" '
                    f'width="{max(1.5, x(row["cured"]) - x(row["at"])):.1f}"/></g>')
    bottom = 8.0 + high * len(names)
    for k in range(7):
        at = begin + (end - begin) * k / 6.0
        parts.append(f'<text x="{x(at):.0f}" y="{bottom + 12}" text-anchor="middle">'
                     f'{(at - begin) / 60.0:.1f} min</text>')
    return (f'<svg xmlns="http://www.w3.org/2000/svg" '
            f'viewBox="0 0 {wide + 16:.0f} {bottom + 20:.0f}" '
            f'font-family="sans-serif" font-size="9">{"".join(parts)}</svg>')


def page(figures: dict, said: str) -> str:
    """Return the report as one HTML page."""
    blocks, table = [], False
    for line in said.splitlines():
        if line.startswith('|---'):
            continue
        if line.startswith('|'):
            cells = ''.join(f'<td>{escape(cell.strip()).replace("**", "")}</td>'
                            for cell in line.strip('|').split('|'))
            blocks.append(('' if table else '<table>') + f'<tr>{cells}</tr>')
            table = True
            continue
        blocks.append(('</table>' if table else '') + (f'<p>{escape(line)}</p>' if line else ''))
        table = False
    closing = '</table>' if table else ''
    return ('<!doctype html><html lang="en"><meta charset="utf-8"><title>Soak</title><style>'
            'body{font:14px/1.4 sans-serif;max-width:1150px;margin:2em auto;padding:0 1em}'
            'table{border-collapse:collapse;margin:1em 0}td{border-bottom:1px solid #ddd;'
            'padding:2px 10px 2px 0;vertical-align:top}tr:first-child{font-weight:bold}</style>'
            '<h1>Soak: faults and what came of them</h1><p>Solid: the fault. Pale: until the '
            'rig is well again.</p>' + time_line(figures) + '\n'.join(blocks) + closing
            + '</html>')
