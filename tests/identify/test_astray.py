"""A reference that is another quantity, and an encoder by its edges: the check ..."""

from dataclasses import replace

import numpy as np
import pytest
from test_shown_factor import AXIS, green, run, said, without

from servo_identify.data.recording_check import check


def with_columns(one, **columns):
    return replace(one, columns={**one.columns, **columns})


def sentences(one, servo=AXIS, word=''):
    return [f'{found.level} {found.sentence}' for found in check([one], servo)
            if word in found.sentence and found.level != 'green']


@pytest.mark.parametrize('factor', [1.0, 4096 / 2 / np.pi])
@pytest.mark.parametrize('beside', [True, False])
def test_it_asks_whether_a_reference_that_goes_as_the_speed_is_one_of_speed(factor, beside):
    one = run()
    one = with_columns(one, reference_position=factor * one['reference_velocity'])
    one = one if beside else replace(one, columns=without(one.columns, 'reference_velocity'))
    found, = sentences(one, word='reference_position')
    assert found == ('amber run: the shaft does not follow reference_position, which goes as the '
                     'speed of the shaft does: is it a reference_velocity?')
    assert not green(one)


def test_it_asks_about_a_reference_of_another_joint():
    time = np.arange(6000) * 1e-3
    found, = sentences(with_columns(run(), reference_position=np.sin(3.1 * time)),
                       word='reference_position')
    assert found.startswith('amber run: the shaft does not follow reference_position, whatever')


def test_it_trusts_a_reference_that_the_controller_follows_badly():
    servo = AXIS.with_values({'controller.ki': 0.0, 'controller.kf': 0.0, 'controller.kv': 0.02})
    assert not sentences(run(servo=servo), servo, 'does not follow')


@pytest.mark.parametrize('references', [True, False])
@pytest.mark.parametrize('factor, told', [(4.0, 'counts read as lines'),
                                          (0.25, 'lines read as counts')])
def test_it_names_the_edges_of_a_quadrature_encoder(factor, told, references):
    one = run(motor_position=factor)
    if not references:
        one = replace(one, columns=without(one.columns, 'reference_velocity',
                                           'reference_position', 'voltage'))
    found = ' '.join(sentences(one))
    assert f'motor_position: {told} of a quadrature encoder' in found
    assert ('red a factor' in found) is (references or factor > 1.0)


def test_it_tells_a_factor_of_three_by_its_number():
    assert not sentences(run(motor_position=3.0), word='quadrature')
    assert all('0.333 times' in found.sentence for found in check(
        [run(motor_position=3.0)], AXIS) if found.level == 'red')
    assert not said(run()) and green(run())
