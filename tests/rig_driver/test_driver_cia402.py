"""The master's side of CiA 402, against a small drive written from the standard's state table."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st
import pytest

from servo_rig_driver.devices.cia402 import Controlword, controlword, drive_state
from servo_rig_driver.devices.drive_master import DriveMaster, DriveState, Order

STATUSWORDS = {
    0x0000: DriveState.NOT_READY,
    0x0250: DriveState.SWITCH_ON_DISABLED,
    0x0231: DriveState.READY_TO_SWITCH_ON,
    0x0233: DriveState.SWITCHED_ON,
    0x0237: DriveState.OPERATION_ENABLED,
    0x0217: DriveState.QUICK_STOP_ACTIVE,
    0x021F: DriveState.FAULT_REACTION_ACTIVE,
    0x0218: DriveState.FAULT,
}


class Drive:
    """Transitions 2 to 16 of CiA 402-2 figure 'state machine', one a step."""

    def __init__(self) -> None:
        self.word = 0x0250
        self.broken = False
        self.before = 0
        self.braked, self.brakes_for = 0, 20  # steps

    def take(self, control: int) -> int:
        if self.word == 0x0218:
            if control & 0x80 and not self.before & 0x80 and not self.broken:
                self.word = 0x0250
        elif control & 0x02 == 0 or control & 0x0F == 0:
            self.word = 0x0250
        elif control & 0x86 == 0x02:
            self.word = {0x0237: 0x0217, 0x0217: 0x0217}.get(self.word, 0x0250)
            self.braked += self.word == 0x0217
            if self.braked > self.brakes_for:
                self.word = 0x0250
        elif self.word == 0x0250 and control & 0x87 == 0x06:
            self.word = 0x0231
        elif self.word == 0x0231 and control & 0x87 == 0x07:
            self.word = 0x0233
        elif self.word == 0x0233 and control & 0x8F == 0x0F:
            self.word = 0x0237
        self.before = control
        return self.word


def answer(master: DriveMaster, word: int, now: float) -> Controlword:
    state = drive_state(word)
    return controlword(master.step(state, now), state)


def lead(master: DriveMaster, drive: Drive, steps: int, start: float = 0.0) -> list[int]:
    sent = []
    for k in range(steps):
        sent.append(int(answer(master, drive.word, start + 1e-3 * k)))
        drive.take(sent[-1])
    return sent


@pytest.mark.parametrize('word,state', STATUSWORDS.items())
def test_it_reads_the_states_of_the_standard(word, state):
    assert drive_state(word) is state


@given(st.integers(0, 0xFFFF))
def test_it_reads_any_statusword_and_minds_the_low_byte_alone(word):
    assert drive_state(word) is drive_state(word & 0x6F)


def test_it_enables_a_drive_in_the_order_of_the_standard():
    master, drive = DriveMaster(), Drive()
    master.enable = True
    assert lead(master, drive, 4) == [0x06, 0x07, 0x0F, 0x0F]
    assert master.enabled


def test_it_takes_the_drive_down_when_told_to():
    master, drive = DriveMaster(), Drive()
    master.enable = True
    lead(master, drive, 5)
    master.enable = False
    sent = lead(master, drive, 25)
    assert sent[:20] == [Controlword.QUICK_STOP] * 20
    assert sent[-1] == Controlword.DISABLE_VOLTAGE
    assert drive_state(drive.word) is DriveState.SWITCH_ON_DISABLED
    assert not master.enabled


def test_it_takes_the_torque_from_a_drive_that_brakes_too_long():
    master, drive = DriveMaster(quick_stop=0.1), Drive()
    master.enable = True
    lead(master, drive, 5)
    master.enable, drive.brakes_for = False, 10_000
    sent = lead(master, drive, 110)
    assert sent.index(Controlword.DISABLE_VOLTAGE) == pytest.approx(100, abs=1)
    assert drive_state(drive.word) is DriveState.SWITCH_ON_DISABLED


def test_it_resets_a_fault_by_an_edge_and_enables_again():
    master, drive = DriveMaster(pause=0.1), Drive()
    master.enable = True
    lead(master, drive, 5)
    drive.word = 0x0218
    sent = lead(master, drive, 110, start=1.0)
    first = sent.index(Controlword.FAULT_RESET)
    assert 99 <= first <= 101
    assert set(sent[:first]) == {Controlword.DISABLE_VOLTAGE}
    assert master.enabled
    assert master.tries == 1


def test_it_gives_up_a_broken_drive_after_the_allowed_resets():
    master, drive = DriveMaster(resets=3, pause=0.1, pulse=0.02), Drive()
    master.enable = True
    drive.word, drive.broken = 0x0218, True
    sent = lead(master, drive, 2000)
    edges = sum(now == 0x80 and then != 0x80 for then, now in pairwise([0, *sent]))
    assert edges == 3
    assert master.given_up
    assert sent[-1] == Controlword.DISABLE_VOLTAGE


def test_a_drive_that_misses_frames_is_reset_for_as_long_as_it_comes_ever_more_seldom():
    master = DriveMaster(resets=3, pause=0.5, pulse=0.05)
    master.enable = True
    orders = [master.step(DriveState.FAULT, 1e-2 * k, missed=True) for k in range(6000)]
    begun = [k for k, (a, b) in enumerate(pairwise(orders)) if a is not b is Order.RESET]
    pauses = [1e-2 * (b - a) for a, b in pairwise(begun)]
    assert not master.given_up and master.tries == 0 and master.missed == len(begun)
    assert pauses[0] == pytest.approx(0.55, abs=0.03)
    assert max(pauses) == pytest.approx(8.05, abs=0.1)
    assert {master.step(DriveState.FAULT, 60.0 + 1e-2 * k) for k in range(1000)} == {
        Order.NO_TORQUE, Order.RESET}
    assert master.given_up and master.tries == 3


def test_a_drive_that_was_given_up_stays_down_though_its_fault_goes_until_begun_again():
    master, drive = DriveMaster(resets=1, pause=0.1, pulse=0.02), Drive()
    master.enable = True
    drive.word, drive.broken = 0x0218, True
    lead(master, drive, 500)
    drive.word, drive.broken = 0x0250, False
    assert set(lead(master, drive, 50, start=1.0)) == {Controlword.DISABLE_VOLTAGE}
    master.begin()
    lead(master, drive, 5, start=2.0)
    assert master.enabled


def test_a_stop_while_the_drive_is_led_up_keeps_it_down_whoever_clears_it():
    master = DriveMaster(pause=0.1)
    master.enable = True
    at = iter(range(1000))

    def orders(state, stopped, times=300):
        return {master.step(state, 1e-3 * next(at), stopped) for _ in range(times)}
    assert orders(DriveState.READY_TO_SWITCH_ON, False, 3) == {Order.ENABLE}
    assert orders(DriveState.FAULT, True) == {Order.NO_TORQUE}
    assert orders(DriveState.SWITCH_ON_DISABLED, False) == {Order.NO_TORQUE}
    master.begin()
    assert orders(DriveState.SWITCH_ON_DISABLED, False, 3) == {Order.ENABLE}


def test_a_stop_from_before_it_was_begun_is_reset_and_a_later_one_is_not():
    master = DriveMaster(pause=0.1)
    master.enable = True
    assert Order.RESET in {master.step(DriveState.FAULT, 1e-3 * k, True) for k in range(300)}
    assert master.step(DriveState.SWITCH_ON_DISABLED, 0.3, False) is Order.ENABLE
    assert {master.step(DriveState.FAULT, 0.3 + 1e-3 * k, True) for k in range(500)} == {
        Order.NO_TORQUE}


@pytest.mark.parametrize('stopped', [0x0250, 0x0231, 0x0233, 0x0217])
def test_a_drive_that_goes_down_without_a_fault_or_an_order_stays_down_until_begun(stopped):
    master, drive = DriveMaster(), Drive()
    master.enable = True
    lead(master, drive, 5)
    drive.word = stopped
    assert set(lead(master, drive, 1000, start=1.0)) == {Controlword.DISABLE_VOLTAGE}
    assert 'without a fault or an order on the bus' in master.why_held
    master.begin()
    lead(master, drive, 5, start=3.0)
    assert master.enabled


def test_a_drive_that_another_stops_while_it_is_led_up_stays_down():
    master = DriveMaster()
    master.enable = True
    states = [DriveState.SWITCH_ON_DISABLED, DriveState.READY_TO_SWITCH_ON,
              DriveState.SWITCH_ON_DISABLED]
    assert [master.step(state, 1e-3 * k) for k, state in enumerate(states)] == [
        Order.ENABLE, Order.ENABLE, Order.NO_TORQUE]


def test_a_drive_that_obeys_an_earlier_order_late_is_not_taken_for_stopped():
    master = DriveMaster()
    master.enable = True
    for k in range(1000):
        master.step(DriveState.OPERATION_ENABLED, 1e-3 * k)
    master.forget()
    states = [DriveState.UNKNOWN, *[DriveState.OPERATION_ENABLED] * 20,
              *[DriveState.SWITCH_ON_DISABLED] * 3, DriveState.OPERATION_ENABLED]
    for k, state in enumerate(states):
        master.step(state, 1.0 + 0.01 * k)
    assert master.enabled and not master.held


def test_it_forgives_old_resets_after_a_while_enabled():
    master, drive = DriveMaster(resets=2, pause=0.1, forgive=0.5), Drive()
    master.enable = True
    drive.word = 0x0218
    lead(master, drive, 1000)
    assert master.tries == 0


@given(st.lists(st.tuples(st.integers(0, 0xFFFF), st.floats(0.0, 0.3)), max_size=60),
       st.booleans())
def test_it_never_enables_operation_but_from_switched_on_or_enabled(words, enable):
    master, now = DriveMaster(), 0.0
    master.enable = enable
    for word, pause in words:
        now += pause
        control = answer(master, word, now)
        if control == Controlword.ENABLE_OPERATION:
            assert enable
            assert drive_state(word) in (DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED)
