"""Which SYNC an answer belongs to."""

from hypothesis import example, given
from hypothesis import strategies as st

from servo_rig_driver.driver.answer_joining import SampleJoiner, sync_counter


def test_it_joins_the_answers_to_one_sync():
    join = SampleJoiner(2)
    join.ask(7)
    assert join.answer(1, 'b', sync_counter(7)) == []
    assert join.answer(0, 'a', sync_counter(7)) == [(7, ['a', 'b'])]


def test_it_counts_syncs_from_1_to_240_as_cia_301_says():
    assert [sync_counter(k) for k in (0, 1, 239, 240, 241)] == [1, 2, 240, 1, 2]


@given(st.data(), st.integers(1, 4), st.sampled_from([0, 1000]))
def test_it_joins_by_counter_however_late_the_answers_come(data, kinds, start):
    join, out = SampleJoiner(kinds), []
    asked, answered = start, [start] * kinds
    while len(out) < 30:
        behind = [kind for kind in range(kinds) if answered[kind] < asked]
        if asked < start + 30 and (not behind or data.draw(st.booleans())):
            join.ask(asked)
            asked += 1
            continue
        kind = data.draw(st.sampled_from(behind))
        out += join.answer(kind, (kind, answered[kind]), sync_counter(answered[kind]))
        answered[kind] += 1
    assert [number for number, _ in out] == list(range(start, start + 30))
    assert all(row == [(kind, number) for kind in range(kinds)] for number, row in out)
    assert (join.lost, join.unasked, join.waiting) == (0, 0, 0)


def test_it_keeps_the_order_through_a_stall_longer_than_the_counter_is_wide():
    join, out = SampleJoiner(2), []
    for number in range(1000):
        join.ask(number)
    for kind in (1, 0):
        for number in range(1000):
            out += join.answer(kind, number, sync_counter(number))
    assert out == [(number, [number, number]) for number in range(1000)]


@given(st.integers(1, 3), st.integers(1, 1100), st.integers(0, 3))
def test_after_a_pause_in_which_all_is_lost_samples_are_those_of_their_instants(kinds, lost, late):
    join, out = SampleJoiner(kinds), []
    for number in range(1500 + lost):
        out += join.ask(number)
        told = number - late  # a drive may be behind by some SYNCs
        if told >= 100 and not 200 <= told < 200 + lost:
            for kind in range(kinds):
                out += join.answer(kind, told, sync_counter(told))
    assert all(row == [number] * kinds for number, row in out)
    assert [number for number, _ in out] == [
        *range(100, 200), *range(200 + lost, 1500 + lost - late)]
    assert join.lost == 100 + lost


@given(st.integers(1, 3), st.integers(1, 700), st.integers(1, 700), st.integers(0, 900))
@example(1, 300, 5, 250)
def test_syncs_that_were_left_out_meanwhile_give_no_sample_the_number_of_another(
        kinds, lost, left_out, at):
    join, out = SampleJoiner(kinds), []
    for number in range(3000):
        if at <= number - 200 < at + left_out:
            continue  # the machine was too busy to ask
        out += join.ask(number)
        for kind in range(kinds if not 200 <= number < 200 + lost else 0):
            out += join.answer(kind, number, sync_counter(number))
    assert all(row == [number] * kinds for number, row in out)
    assert out[-1][0] == 2999
    assert len(out) + join.lost + join.waiting == 3000 - left_out


@given(st.sets(st.tuples(st.integers(0, 1), st.integers(0, 59)), max_size=40), st.booleans())
def test_it_loses_the_samples_of_lost_answers_alone(lost, counted):
    join, out = SampleJoiner(2), []
    for number in range(60):
        join.ask(number)
        for kind in (0, 1):
            if (kind, number) not in lost:
                out += join.answer(kind, number, sync_counter(number) if counted else None)
    join.restart()
    gone = {number for _, number in lost}
    assert out == [(k, [k, k]) for k in range(60) if k not in gone]
    assert join.lost == len(gone)


def test_it_counts_answers_that_nobody_asked_for():
    join = SampleJoiner(1)
    assert join.answer(0, 'x', 1) == []
    join.ask(0)
    assert join.answer(0, 'y', 1) == [(0, ['y'])]
    assert join.answer(0, 'y', None) == []
    assert join.unasked == 2


@given(st.integers(1, 2), st.lists(max_size=8, elements=st.tuples(
    st.integers(0, 300), st.integers(1, 500), st.integers(0, 300), st.integers(0, 300))))
@example(1, [(0, 241, 0, 1), (0, 480, 0, 0)])
@example(1, [(0, 701, 200, 1), (0, 1, 29, 1), (0, 300, 0, 0)])
def test_samples_come_in_the_order_of_syncs_that_went_out_and_each_once(kinds, stretches):
    join, number, waiting, asked, out = SampleJoiner(kinds), 0, [], set(), []
    for left_out, asks, lost, answers in stretches:
        number += left_out
        for _ in range(asks):
            out += join.ask(number)
            waiting.append(number)
            assert all(sample in asked for sample, _ in out)
            asked.add(number)
            number += 1
        del waiting[:lost]
        for one in waiting[:answers]:
            for kind in range(kinds):
                out += join.answer(kind, one, sync_counter(one))
        del waiting[:answers]
    assert [sample for sample, _ in out] == sorted({sample for sample, _ in out})
    assert len(out) + join.lost + join.waiting + len(join._kept) == len(asked)
