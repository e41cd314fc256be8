"""Two nodes of one id are told from one that was held up: it ..."""

from itertools import repeat

import pytest

from servo_rig_driver.devices.doubled_ids import doubled, PROMPT, PROOFS

MS = 1_000_000
PAIR, ONE = ({1}, 5 * MS), (set(), 5 * MS)
LATE_PAIR = HELD_UP = ({1}, 2 * PROMPT)  # nobody can tell which


@pytest.mark.parametrize('counts, found', [
    ([PAIR] * PROOFS, {1}),
    ([PAIR] * (PROOFS - 1) + [ONE], set()),
    ([LATE_PAIR, PAIR, LATE_PAIR, LATE_PAIR, PAIR, PAIR], {1}),
    ([HELD_UP, HELD_UP, ONE], set()),
    (repeat(HELD_UP), set()),
], ids=['a pair', 'once only', 'a pair on a busy machine', 'one that was held up',
        'one that is held up for long'])
def test_it_takes_two_prompt_answers_time_and_again_for_a_pair(counts, found):
    counts = iter(counts)
    assert doubled({1, 2}, lambda: next(counts), lambda: True) == found


def test_it_ends_when_it_is_wanted_no_more():
    asked = []

    def count():
        asked.append(True)
        return HELD_UP
    assert doubled({1}, count, lambda: len(asked) < 3) == set()
    assert len(asked) == 3
