"""Which request an answer that names none belongs to."""

from hypothesis import given, settings
from hypothesis import strategies as st

from servo_rig_driver.driver.order_joining import OrderJoiner

PATIENCE, SILENCE = 10, 10


def test_it_takes_no_answer_for_that_to_a_request_that_reached_nobody():
    join = OrderJoiner(1, PATIENCE, SILENCE)
    for number in (1, 2, 3):
        join.ask(number)
    assert join.answer(0, 'a', None) == []
    assert join.withdraw(2) == []
    assert join.answer(0, 'c', None) == []
    assert join.ask(4) == [(1, ['a']), (3, ['c'])]
    assert (join.lost, join.waiting) == (1, 1)
    assert join.ask(5) == []
    assert join.answer(0, 'd', None) == []
    assert join.withdraw(5) == [(4, ['d'])]


def test_it_counts_an_answer_that_comes_twice_and_leaves_it_out():
    join = OrderJoiner(2, PATIENCE, SILENCE)
    join.ask(3)
    assert join.answer(1, 'b', None) == []
    assert join.answer(1, 'b', None) == []
    assert join.answer(0, 'a', None) == [(3, ['a', 'b'])]
    assert join.answer(0, 'a', None) == []
    assert (join.lost, join.unasked) == (0, 2)


def test_an_answer_that_comes_twice_among_several_costs_all_of_them():
    join = OrderJoiner(1, PATIENCE, SILENCE)
    for number in (1, 2, 3):
        join.ask(number)
    for word in ('a', 'a', 'b', 'c'):
        assert join.answer(0, word, None) == []
    assert join.ask(4) == []
    assert (join.lost, join.unasked) == (3, 1)
    assert join.answer(0, 'd', None) == [(4, ['d'])]


class Drive:
    """Answers by FIFO, as late as it is told, and loses what it is told; time is ticks."""

    def __init__(self, kinds, lost, lateness):
        self.join = OrderJoiner(kinds, PATIENCE, SILENCE)
        self.kinds, self.lost, self.lateness = kinds, lost, lateness
        self.out, self.asked, self.held_back, self.now = [], 0, 0, 0
        self._under_way = []

    def tick(self, asks=True):
        self.now += 1
        self._arrive()
        may_ask = self.join.may_ask(1)
        if not asks:
            return
        if not may_ask:
            self.held_back += 1
            return
        number, self.asked = self.asked, self.asked + 1
        self.out += self.join.ask(number)
        due = self.now + self.lateness.get(number, 0)
        for kind in range(self.kinds):
            if (kind, number) not in self.lost:
                after = self._under_way[-1][0] if self._under_way else 0
                self._under_way.append((max(due, after), kind, number))
        self._arrive()

    def _arrive(self):
        while self._under_way and self._under_way[0][0] <= self.now:
            _, kind, number = self._under_way.pop(0)
            self.out += self.join.answer(kind, number, None)


@given(st.sets(st.tuples(st.integers(0, 1), st.integers(0, 99)), max_size=3),
       st.dictionaries(st.integers(0, 99), st.integers(1, PATIENCE - 1), max_size=5),
       st.integers(1, 2))
@settings(max_examples=50)
def test_no_answer_is_given_to_another_request_whichever_are_lost_or_late(lost, lateness, kinds):
    lost = {(kind, number) for kind, number in lost if kind < kinds}
    drive = Drive(kinds, lost, lateness)
    for _ in range(300):
        drive.tick(drive.asked < 100)
    drive.out += drive.join.ask(100)
    assert all(row == [number] * kinds for number, row in drive.out)
    assert drive.join.lost + len(drive.out) == 100
    assert drive.join.waiting == 1
    assert drive.join.unasked == 0
    assert drive.join.lost <= len(lost) * (PATIENCE + 1 + max(lateness.values(), default=0))
    assert drive.held_back <= (len(lost) + len(lateness)) * (SILENCE + 1)


def test_a_drive_that_falls_behind_is_asked_no_more_until_it_has_caught_up():
    drive = Drive(1, set(), {5: 4 * PATIENCE})
    seen = []
    for _ in range(12 * PATIENCE):
        drive.tick()
        seen.append(drive.join.waiting)
    assert max(seen) <= PATIENCE + 2
    assert seen[-1] == 0


def test_one_answer_in_a_hundred_that_is_lost_does_not_cost_the_samples_of_answer_timeout():
    lost = range(50, 20_000, 100)
    drive = Drive(1, {(0, number) for number in lost}, {})
    drive.join.patience, drive.join.silence = 500, 25  # at 500 Hz 1 s, half of a watchdog of 0.1 s
    for _ in range(20_000):
        drive.tick()
    assert all(row == [number] for number, row in drive.out)
    assert len(drive.out) / 20_000 > 0.6


def test_a_drive_that_is_always_behind_is_seldom_left_unasked():
    drive = Drive(1, set(), dict.fromkeys(range(20_000), 3))
    drive.join.patience = 500
    for _ in range(20_000):
        drive.tick()
    assert drive.held_back < 100  # of which 78 by answer_timeout
    assert drive.join.lost == 0


def test_a_drive_that_is_silent_is_waited_for_as_long_as_before():
    join = OrderJoiner(1, 500, 25)
    asked = 0
    for now in range(600):
        if not join.may_ask(1):
            break
        join.ask(now)
        asked += 1
    assert asked == 501
