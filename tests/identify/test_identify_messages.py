"""What the identify node takes of the twin's residuals: nothing that no samples can have."""

from math import inf, nan

import pytest

from servo_identify.nodes.message_conversion import to_residuals
from servo_twin.recording.recording import BALANCES
from servo_twin_msgs.msg import Residual


def residual(period=1e-3, sequence=0, **columns):
    return Residual(period=period, sequence=sequence,
                    **{name: [1.0, 2.0] for name in BALANCES} | columns)


def test_it_takes_the_balances_side_by_side():
    assert to_residuals(residual()).tolist() == [[1.0] * len(BALANCES), [2.0] * len(BALANCES)]


@pytest.mark.parametrize(('given', 'said'), [
    ({BALANCES[0]: [1.0]}, 'has .* 1, .* 2, '), ({'period': nan}, 'Residual.period = nan is'),
    ({'period': inf}, 'Residual.period = inf is outside'), ({'period': 1e-9}, 'outside'),
    ({'sequence': 2**64 - 1}, 'Residual.sequence = 18446744073709551615 is outside')])
def test_it_refuses_a_message_that_no_twin_sends(given, said):
    with pytest.raises(ValueError, match=said):
        to_residuals(residual(**given))
