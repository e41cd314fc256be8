"""Messages too many to be held: their import, part by part, ..."""

import json
import tracemalloc

from bench_recording import SERVO
from mcap.writer import Writer
import numpy as np
import pytest
from test_long_recordings import samples_of_bag

from servo_identify.cli import main
from servo_identify.commands import import_table
from servo_identify.data import import_in_parts, on_disk
from servo_twin.recording import parts

PERIOD, START = 0.002, 1_700_000_000_000_000_000


def even(k):
    return k * PERIOD


def jittered(k):
    return k * PERIOD + np.random.default_rng(2).uniform(-0.3, 0.3, len(k)) * PERIOD


def with_holes(k):
    return jittered(k) + 0.05 * (k > 311) + 0.1 * (k > 700)


def back_once(k):
    times = even(k)
    times[[400, 401]] = times[[401, 400]]
    return times


def log(path, times):
    """Write a joint at these times, s, and a slower command that begins late and falls silent."""
    with path.open('wb') as stream:
        writer = Writer(stream, chunk_size=20_000)  # one is held at a time
        writer.start()
        schema = writer.register_schema('any', 'jsonschema', b'{}')
        topics = {name: writer.register_channel(name, 'json', schema)
                  for name in ('/joint', '/command', '/aside')}

        def say(topic, ns, **content):
            writer.add_message(topics[topic], ns, json.dumps(content).encode(), ns)

        for k, at in enumerate(times):
            ns = START + round(at * 1e9)
            stamp = {'sec': ns // 10**9, 'nanosec': ns % 10**9}
            say('/joint', ns, stamp=stamp, q=0.1 * np.sin(0.02 * k),
                i=None if k % 17 == 3 else 0.1 * k)
            if k % 7 == 0 and (k < 500 or k > 800) and k > 10:
                say('/command', ns + 400_000, u=float(k), torque=0.5 * k)
            say('/aside', ns, x=1.0)
        writer.finish()
    mapping = path.with_suffix('.yaml')
    mapping.write_text('time: {source: /joint.stamp}\ncolumns:\n'
                       '  load_position: {source: /joint.q}\n'
                       '  current: {source: /joint.i}\n'
                       '  voltage: {source: /command.u, scale: 0.5}\n'
                       '  torque: {source: /command.torque}\n')
    return ['import', str(path), '--servo', str(SERVO), '--mapping', str(mapping)]


@pytest.mark.parametrize('period', [0.0, 0.003])
@pytest.mark.parametrize('times', [even, jittered, with_holes, back_once])
def test_is_that_of_the_whole(times, period, tmp_path, monkeypatch, capsys):
    words = [*log(tmp_path / 'log.mcap', times(np.arange(1200))), '--period', str(period)]
    monkeypatch.setattr(import_in_parts, 'ROWS', 37)
    monkeypatch.setattr(on_disk, '_WRITES', 100)
    found = []
    for least in (np.inf, 0.0):
        monkeypatch.setattr(import_table, 'IN_PARTS_FROM', least)
        out = tmp_path / str(least) / 'out'
        status = main([*words, '-o', str(out)])
        said = capsys.readouterr().err.replace(str(out), 'out')
        found.append((status, said, samples_of_bag(out) if out.exists() else {}))
    assert found[0] == found[1]
    assert found[0][0] == 0
    assert ('times are not even' in found[0][1]) == (times in (jittered, with_holes) or period > 0)
    assert ('lie in holes' in found[0][1]) == (times is with_holes)


@pytest.mark.long
def test_holds_little_of_each_message(tmp_path, monkeypatch):
    monkeypatch.setattr(import_table, 'IN_PARTS_FROM', 0.0)
    monkeypatch.setattr(parts, 'SAMPLES', 500)
    monkeypatch.setattr(import_in_parts, 'ROWS', 500)
    monkeypatch.setattr(import_in_parts, 'LOOKED_AT', 500)
    monkeypatch.setattr(on_disk, '_WRITES', 500)
    peaks, counts = [], (2000, 10_000)
    for count in counts:
        words = log(tmp_path / f'log{count}.mcap', jittered(np.arange(count)))
        main([*words, '-o', str(tmp_path / 'warm'), '--force', '--quiet'])
        tracemalloc.start()
        assert main([*words, '-o', str(tmp_path / f'out{count}'), '--quiet']) == 0
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] - peaks[0] < 60.0 * (counts[1] - counts[0])  # held whole, some 300 each
