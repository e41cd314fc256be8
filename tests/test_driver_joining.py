"""Which SYNC an answer belongs to."""

from hypothesis import given
from hypothesis import strategies as st
import pytest

from servo_rig_driver.joining import SampleJoiner


def test_it_joins_the_answers_to_one_sync():
    join = SampleJoiner(2, 'order')
    join.ask(7)
    assert join.answer(1, 'b') == []
    assert join.answer(0, 'a') == [(7, ['a', 'b'])]


@given(st.data(), st.integers(1, 4))
def test_it_joins_by_order_however_late_the_answers_come(data, kinds):
    join, out = SampleJoiner(kinds, 'order'), []
    asked, answered = 0, [0] * kinds
    while len(out) < 30:
        behind = [kind for kind in range(kinds) if answered[kind] < asked]
        if asked < 30 and (not behind or data.draw(st.booleans())):
            join.ask(asked)
            asked += 1
            continue
        kind = data.draw(st.sampled_from(behind))
        out += join.answer(kind, (kind, answered[kind]))
        answered[kind] += 1
    assert [number for number, _ in out] == list(range(30))
    assert all(row == [(kind, number) for kind in range(kinds)] for number, row in out)
    assert (join.lost, join.unasked, join.waiting) == (0, 0, 0)


def test_it_loses_one_sample_by_one_lost_frame_when_joining_to_the_last_sync():
    join, out = SampleJoiner(2, 'last'), []
    for number in range(5):
        join.ask(number)
        out += join.answer(0, number)
        if number != 2:
            out += join.answer(1, number)
    assert [number for number, _ in out] == [0, 1, 3, 4]
    assert all(row == [number, number] for number, row in out)
    assert join.lost == 1


def test_it_counts_answers_that_nobody_asked_for():
    join = SampleJoiner(1, 'order')
    assert join.answer(0, 'x') == []
    join.ask(0)
    assert join.answer(0, 'y') == [(0, ['y'])]
    assert join.unasked == 1


def test_it_holds_samples_in_doubt_and_releases_them_when_all_is_answered():
    join = SampleJoiner(1, 'order')
    join.ask(0)
    join.ask(1)
    join.doubt()
    assert join.answer(0, 'a') == []
    assert join.answer(0, 'b') == [(0, ['a']), (1, ['b'])]
    assert not join.in_doubt


def test_it_gives_nothing_shifted_out_after_a_lost_answer():
    join = SampleJoiner(2, 'order')
    for number in range(3):
        join.ask(number)
    join.doubt()  # the answer of kind 1 to SYNC 0 was no frame
    out = join.answer(0, 0) + join.answer(0, 1) + join.answer(1, 1)
    out += join.answer(0, 2) + join.answer(1, 2)
    assert out == []
    join.restart()
    assert join.lost == 3
    join.ask(9)
    join.answer(0, 9)
    assert join.answer(1, 9) == [(9, [9, 9])]


def test_it_refuses_an_unknown_rule():
    with pytest.raises(ValueError, match=r"join = 'luck' is unknown; it is one of"):
        SampleJoiner(1, 'luck')
