"""Looks at the bus of a rig: what the drive was told, how it stands, and who boots."""

from __future__ import annotations

from time import monotonic

from bus_listener import BusListener
from driver_bench import wait_for
from held_up import held_up_since

from servo_rig_driver.devices.pdo_table import load_frames, NMT_ID

ENABLED, QUICK_STOP, DISABLED, FAULT = 0x27, 0x07, 0x40, 0x08
UNSEEN = 0.1  # s that a machine must stand still for the brake of a motor not to be seen


class CanWatcher(BusListener):
    """
    Keeps, each once as it changes, controlwords and statuswords (masked), and all NMT frames.

    ``ask`` reads the statusword by SDO, for a drive that gets no SYNC. ``beaten``: whether the
    drive was heard at all.
    """

    def __init__(self, channel: str) -> None:
        self.controls: list[int] = []
        self.states: list[int] = []
        self.managed: list[bytes] = []
        self.beaten = False
        self._answer: list[int] = []
        table = load_frames()
        self._control, self._status = table['drive.rpdo1'], table['drive.tpdo2']
        super().__init__(channel, self._look)

    def _look(self, identifier: int, data: bytes) -> None:
        if identifier == self._control.cob_id:
            self._keep(self.controls, int(self._control.decode(data)['controlword']))
        elif identifier == self._status.cob_id:
            self._keep(self.states, masked(int(self._status.decode(data)['statusword'])))
        elif identifier == 0x701:
            self.beaten = True
        elif identifier == NMT_ID:
            self.managed.append(data)
        elif identifier == 0x581 and data[1:3] == b'\x41\x60':
            self._answer.append(masked(int.from_bytes(data[4:6], 'little')))

    @staticmethod
    def _keep(kept: list[int], value: int) -> None:
        if not kept or kept[-1] != value:
            kept.append(value)

    def ask(self) -> int:
        """Return the state of the drive as its statusword tells now."""
        self._answer.clear()
        self.wire.send([(0x601, b'\x40\x41\x60\x00' + bytes(4))])
        wait_for(lambda: self._answer, 'the drive tells its statusword')
        return self._answer[0]

    def forget(self) -> None:
        """Forget what the drive was told and how it stood, until now."""
        self.catch_up()
        self.controls.clear()
        self.states.clear()

    def saw_it_go_down(self, since: float, within: float, turns: bool = True) -> None:
        """
        Check that the drive braked, then had no torque, within some s of an instant.

        A motor at rest (``turns`` false) brakes unseen; so may one that comes to rest while a busy
        machine makes no sample.
        """
        try:
            wait_for(lambda: DISABLED in self.states, 'the drive is down')
        except AssertionError as error:
            raise AssertionError(f'{error}: {self.states}, {self.controls}') from None
        held_up = held_up_since(since)
        assert monotonic() - since < within + held_up
        told = f'{self.states}, {self.controls}'
        assert self.controls[self.controls.index(0x02):] in ([0x02], [0x02, 0x00]), told
        assert self.states[-1] == DISABLED, told
        assert not turns or QUICK_STOP in self.states or held_up > UNSEEN, told


def masked(statusword: int) -> int:
    """Return the state that a statusword tells (CiA 402-2)."""
    return statusword & (0x4F if not statusword & 0x20 and statusword & 0x48 else 0x6F)
