"""A current that is another than the torque constant asks for: the check ..."""

from dataclasses import replace
from functools import lru_cache

import pytest
from test_shown_factor import AXIS, run, without

from servo_identify.data.recording_check import check
from servo_twin.description.servo_file import dumps, loads


@lru_cache
def plain():
    one = run()
    return replace(one, columns=without(one.columns, 'voltage', 'reference_velocity',
                                        'reference_position'))


def said(factor, servo=AXIS):
    one = plain()
    one = replace(one, columns={**one.columns, 'current': factor * one['current']})
    return [found for found in check([one], servo) if found.sentence.startswith('The current is')]


@pytest.mark.parametrize('factor, name', [
    (2.0**0.5, '1.414 would be the peak of a sine'), (2.0**-0.5, '0.7071 would be the effective'),
    (1.5, '1.5 would be the current of the q axis'), (1 / 1.5, 'the current of one phase, where'),
    (3.0**0.5, '1.732 would be the current of a line'),
    (3.0**-0.5, '0.5774 would be the current of a winding in delta')])
def test_it_names_the_factor_of_another_current(factor, name):
    found, = said(factor)
    assert found.level == 'amber' and name in found.sentence and 'torque constant' in found.action
    assert float(found.sentence.split()[3]) == pytest.approx(factor, rel=0.05)
    assert found.sentence.count('would be') == 1


@pytest.mark.parametrize('factor', [1.0, 1.2, 0.85])
def test_it_says_nothing_of_a_factor_without_a_name(factor):
    assert not said(factor)


def test_it_says_nothing_of_what_the_tolerance_allows():
    servo = loads(dumps(AXIS).replace('tolerance: {}',
                                         'tolerance: {mechanism.load_inertia: 60 %, '
                                         'mechanism.rotor_inertia: 60 %}'))
    assert servo.tolerance and not said(1.5, servo)
