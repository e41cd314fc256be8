"""The place of a change, on emulated rigs that do a working cycle: it ..."""

from pathlib import Path
import sys

import numpy as np
import pytest

from servo_identify.watch.changes.change_place import ChangePlace, Located
from servo_twin.description import servo_file
from servo_twin.description.shipped import shipped
from servo_twin.recording.joined_samples import samples_of

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'benchmarks'))
from detector_cases import CHANGES, PERIOD, played

AT, END, LEARN = 50.0, 62.0, 40.0


def watched(rig, change, at=AT):
    """Return what watches a rig on which a change comes, with all samples given."""
    servo = servo_file.load(shipped(f'servos/{rig}.yaml'))
    found = ChangePlace(servo, PERIOD, 0.25, LEARN)
    known = next(one for one in CHANGES if one.name == change)
    rows, half = samples_of(played(rig, END, 3, known, at).columns), found.half
    for first in range(half, len(rows) - half, 500):
        count = min(500, len(rows) - half - first)
        found.push(first, rows[first - half:first + count + half])
    return found


@pytest.mark.slow
@pytest.mark.parametrize(('rig', 'change', 'place'), [
    ('rv_plain', 'load friction +30 %', 'load'), ('rv_plain', 'motor friction +30 %', 'motor'),
    ('rv_bench', 'drive gain -5 %', 'drive'), ('rv_plain', 'torque sensor off', 'sensor'),
    ('geared_dc', 'current sensor +5 %', 'sensor'), ('rv_plain', 'torque sensor sticks', 'sensor'),
    ('geared_dc', 'backlash doubled', 'transmission'),
    ('geared_dc', 'transmission error tripled', 'transmission')])
def test_it_names_the_place_by_the_equations_that_the_change_enters(rig, change, place):
    told = watched(rig, change).locate(round((AT - 1.0) / PERIOD))
    assert told.places == (place,), told
    assert sum(told.probability.values()) == pytest.approx(1.0)
    assert place in str(told) and told.likeliest[place] in str(told)


@pytest.mark.slow
def test_it_names_both_shafts_where_no_channel_tells_their_friction_apart():
    told = watched('dc_gearmotor', 'motor friction +30 %').locate(round((AT - 1.0) / PERIOD))
    assert set(told.places) <= {'motor', 'load'}, told


def test_it_knows_nothing_before_it_has_learned():
    servo = servo_file.load(shipped('servos/rv_plain.yaml'))
    fresh = ChangePlace(servo, PERIOD, 0.25, LEARN)
    assert fresh.locate(0) is None
    fresh.push(0, np.zeros((1000 + 2 * fresh.half, 12)))
    assert fresh.locate(0) is None
    fresh.relearn()
    assert fresh.locate(0) is None


def test_it_names_as_many_places_as_it_takes_to_be_sure():
    told = Located({'motor': 0.6, 'load': 0.38, 'drive': 0.02}, dict.fromkeys(
        ('motor', 'load', 'drive'), 'friction'))
    assert told.places == ('motor', 'load')
    assert str(told) == 'motor (friction, 60 %) or load (friction, 38 %)'
