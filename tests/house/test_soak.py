"""A short soak: a handful of faults, judged from the log of the bus; `make soak` tries longer."""

import json
from pathlib import Path
import subprocess
import sys
from time import time

import numpy as np
import pytest

from servo_rig_driver.devices.pdo_table import sync_counter
from servo_twin_msgs.msg import Prediction

pytestmark = [pytest.mark.ros, pytest.mark.slow]
SOAK = Path(__file__).resolve().parents[1] / 'soak'
FAULTS = ['driver KILL', 'recorder KILL', 'emulated_rig TERM', 'wire short', 'odd commands',
          'odd servo files']


@pytest.mark.long
@pytest.mark.timeout(400)
def test_nothing_is_lost_unsaid_and_no_old_set_point_reaches_the_drive(tmp_path):
    done = subprocess.run([sys.executable, str(SOAK / 'soak.py'), '40s', '--seed', 'house',
                           '--no-identify', '--most', '6', '-o', str(tmp_path), '--only',
                           *FAULTS], capture_output=True, text=True, timeout=380)
    assert (tmp_path / 'soak.json').exists(), done.stderr[-2000:]
    seen = json.loads((tmp_path / 'soak.json').read_text())
    assert len(seen['rows']) >= 2
    assert seen['commands'] > 1000
    assert seen['stale'] == seen['beyond'] == []
    assert seen['bags']['untold'] == seen['bags']['unreadable'] == []
    assert seen['traces'] == seen['left'] == seen['killed'] == []
    assert [row['faults'] for row in seen['rows'] if row['well'] is None] == []
    assert [(name, said) for name, alike, said in seen['replays'] if not alike] == []
    assert '<svg' in (tmp_path / 'soak.html').read_text()


def test_a_set_point_tells_its_own_age():
    sys.path.insert(0, str(SOAK))
    from witness import age, HALF, reference
    for at in (3.0, 19.9, 20.1, 33.3, 1e9 + 7.0):
        for late in (0.0, 0.05, 0.4):
            assert age(reference(at), at + late) == pytest.approx(late, abs=1e-6) or abs(
                at % HALF) > HALF - 0.5 or at % HALF < 0.5


def test_a_set_point_that_the_witness_saw_late_is_not_taken_for_an_old_one():
    sys.path.insert(0, str(SOAK))
    from witness import age, HALF, reference
    turn = 2.0 * HALF * 44_891_024 + HALF
    assert age(reference(turn + 1.7), turn - 0.5) > 1.0  # it would seem to be of before the turn
    assert age(reference(turn + 1.7), turn - 0.5, turn + 1.75) <= 0.0
    assert age(reference(turn - 8.0), turn - 6.0, turn - 5.5) == pytest.approx(2.0, abs=1e-6)


def test_a_change_that_the_detector_names_in_calm_is_a_miss_and_one_of_a_fault_is_none():
    sys.path.insert(0, str(SOAK))
    from report import _changes
    rows = [{'at': 100.0, 'cured': 101.0, 'well': 102.0},
            {'at': 200.0, 'cured': 201.0, 'well': None}]
    for at, calm, kept in ((105.0, 88, True), (150.0, 88, False), (205.0, 88, True),
                           (300.0, 88, True)):
        said, is_kept = _changes({'rows': rows, 'events': [[at, 'change', '']], 'quiet': []})
        assert f'in {calm} s' in said and is_kept is kept
    rows[1]['at'] = 115.0
    assert _changes({'rows': rows, 'events': [], 'quiet': []})[1] is None


def test_its_noise_is_not_taken_for_what_the_driver_told_the_drive(tmp_path):
    sys.path.insert(0, str(SOAK))
    from wire_proxy import WireProxy
    proxy = WireProxy('rig', 'driver', str(tmp_path / 'log'), str(tmp_path / 'answers'))
    proxy.mode = {'mode': 'noise'}
    made = [frame for _ in range(40_000) for frame in proxy._spoilt('rig', [])]
    proxy._note('driver', made, 0.0)
    assert len(made) > 30_000 and (tmp_path / 'log').read_bytes() == b''


class Heard:
    """What a witness and a recorder hear of a rig whose SYNC k is due at BEGIN + k ms."""

    BEGIN = 1_795_825_900.0

    def __init__(self, tmp_path, late, monkeypatch):
        sys.path.insert(0, str(SOAK))
        from answers import Answers
        import wire_proxy
        proxy = wire_proxy.WireProxy('rig', 'driver', *(str(tmp_path / name)
                                                        for name in ('log', 'answers')))
        seen = iter(self.BEGIN + 1e-3 * np.arange(len(late)) + late)
        monkeypatch.setattr(wire_proxy, 'time', lambda: next(seen))
        self.number = np.arange(9000)
        self.due = self.BEGIN + 1e-3 * self.number
        self.angle = np.empty(len(self.number))
        for k in self.number:
            sent = proxy.encoder.pack([0.5 * np.sin(1e-3 * k), sync_counter(int(k))])
            self.angle[k] = proxy.encoder.unpack(sent)[0]
            proxy._note('driver', [(proxy.encoder.cob_id, sent)], 0.0)
        self.answers = Answers.read(tmp_path / 'answers')


def test_samples_that_come_late_are_not_lost_ones(tmp_path, monkeypatch):
    sys.path.insert(0, str(SOAK))
    from bags import untold
    late = 0.001 + 0.3 * (np.arange(9000) > 6000)  # as where the machine holds the bus up
    heard = Heard(tmp_path, late, monkeypatch)
    assert untold(heard.number, heard.due, heard.angle, heard.answers) == []


def test_a_driver_that_loses_samples_and_counts_on_is_found(tmp_path, monkeypatch):
    sys.path.insert(0, str(SOAK))
    from bags import untold
    heard = Heard(tmp_path, np.full(9000, 0.001), monkeypatch)
    kept = np.delete(heard.angle, slice(4000, 4008))  # and those after them get their numbers
    said = untold(heard.number[:-8], heard.due[:-8], kept, heard.answers)
    assert said and all('the SYNC 8 after' in one for one in said)
    assert sum(int(one.split()[0]) for one in said) > 4980  # some angles come again
    told = np.delete(heard.number, slice(4000, 4008))
    assert untold(told, heard.due[told], kept, heard.answers) == []


def test_a_witness_that_is_behind_does_not_take_an_ended_node_for_a_running_one():
    sys.path.insert(0, str(SOAK))
    from witness import last_instant
    now = time()
    old = Prediction(period=1e-3, load_position=[0.0] * 10)
    old.header.stamp.sec = int(now) - 6
    assert last_instant(old) < now - 5.0  # though it is heard only now
    old.header.stamp.sec = int(now) + 3600  # of a clock that was set
    assert last_instant(old) <= time()


def test_a_task_without_an_answer_or_whose_memory_stays_is_a_miss():
    sys.path.insert(0, str(SOAK))
    from tasks import judged
    row = {'kind': 'retrain', 'seconds': 20.0, 'answer': 'retrained', 'success': True,
           'before': 200.0, 'after': 212.0, 'left': 0}

    def kept(*rows):
        return [one for *_, one in judged(list(rows))]

    assert judged([]) == []
    assert kept(row, {'kind': 'diagnose', 'cut': True}) == [True, True]
    assert kept(row, {'kind': 'diagnose'}) == [False, True]
    assert kept(row | {'after': 400.0}) == kept(row | {'left': 1}) == [True, False]
    assert '1 of 1, the slowest after 20 s; 1 retrainings, 0 diagnoses' in judged([row])[0][1]


def test_a_change_that_was_made_in_a_quiet_stretch_is_no_false_one():
    sys.path.insert(0, str(SOAK))
    from report import _changes
    rows = [{'at': 100.0, 'cured': 101.0, 'well': 102.0},
            {'at': 900.0, 'cured': 901.0, 'well': 902.0}]
    stretch = {'begin': 150.0, 'end': 700.0, 'over': 760.0}
    for at, kept in ((710.0, True), (765.0, True), (400.0, False)):
        said, is_kept = _changes({'rows': rows, 'events': [[at, 'change', '']],
                                  'quiet': [stretch]})
        assert f'in {38 + 540 + 130} s' in said and is_kept is kept


def test_what_grows_in_a_quiet_stretch_is_a_miss_though_it_was_flat_between_faults():
    sys.path.insert(0, str(SOAK))
    from quiet import judged
    from witness import Usage
    usage = Usage()
    for at in range(0, 1200, 2):  # a process that begins to leak after 900 s
        usage.rows += [(float(at), 'twin', 7, 200.0 + max(0, at - 900) / 60.0, 9, 30),
                       (float(at), 'driver', 8, 80.0, 9, 30 + (at == 1198))]
    row = {'well': True, 'loaded': True, 'found': 12.0, 'place': 'load'}

    def kept(begin, end, **changed):
        slopes = usage.slopes(60.0, (begin, end))
        return [one for *_, one in judged([row | {'slopes': slopes} | changed])]

    assert judged([]) == []
    assert kept(0.0, 800.0) == [True, True, True]
    assert kept(900.0, 1190.0) == [True, False, True]  # 60 MiB an hour
    assert kept(0.0, 800.0, found=None) == [True, True, False]
    assert kept(0.0, 30.0)[1] is None  # nothing lived for as long as is asked
    assert not kept(0.0, 800.0, well=False)[0]


def test_a_file_that_stays_open_in_a_quiet_stretch_is_a_miss():
    sys.path.insert(0, str(SOAK))
    from quiet import judged
    row = {'well': True, 'loaded': True, 'slopes': [('driver', 4.0, 0.1, 0, 1)]}
    (_, well), (said, flat) = [(said, kept) for _, said, kept in judged([row])]
    assert well and not flat and 'driver: +0 threads, +1 files' in said
