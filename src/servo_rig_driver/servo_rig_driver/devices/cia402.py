"""
CiA 402 on the wire: which state a statusword tells, which controlword gives an order.

Source: CiA 402-2 (IEC 61800-7-201), tables "state coding" of object 6041h and "command coding" of
object 6040h.
"""

from __future__ import annotations

from enum import IntEnum

from .drive_master import DriveState, Order


class Controlword(IntEnum):
    """The commands of object 6040h that a master needs."""

    DISABLE_VOLTAGE = 0x00
    QUICK_STOP = 0x02
    SHUTDOWN = 0x06
    SWITCH_ON = 0x07
    ENABLE_OPERATION = 0x0F
    FAULT_RESET = 0x80


_CODING = {
    DriveState.NOT_READY: (0x4F, 0x00),
    DriveState.SWITCH_ON_DISABLED: (0x4F, 0x40),
    DriveState.READY_TO_SWITCH_ON: (0x6F, 0x21),
    DriveState.SWITCHED_ON: (0x6F, 0x23),
    DriveState.OPERATION_ENABLED: (0x6F, 0x27),
    DriveState.QUICK_STOP_ACTIVE: (0x6F, 0x07),
    DriveState.FAULT_REACTION_ACTIVE: (0x4F, 0x0F),
    DriveState.FAULT: (0x4F, 0x08),
}
"""The states of a CiA 402 drive: (mask of the statusword, value under the mask)."""

_UPWARD = {
    DriveState.SWITCH_ON_DISABLED: Controlword.SHUTDOWN,
    DriveState.READY_TO_SWITCH_ON: Controlword.SWITCH_ON,
    DriveState.SWITCHED_ON: Controlword.ENABLE_OPERATION,
    DriveState.OPERATION_ENABLED: Controlword.ENABLE_OPERATION,
}
_ORDERS = {Order.NO_TORQUE: Controlword.DISABLE_VOLTAGE, Order.QUICK_STOP: Controlword.QUICK_STOP,
           Order.RESET: Controlword.FAULT_RESET}


def _decode(statusword: int) -> DriveState:
    for state, (mask, value) in _CODING.items():
        if statusword & mask == value:
            return state
    return DriveState.UNKNOWN


_STATES = tuple(_decode(low) for low in range(0x80))


def drive_state(statusword: int) -> DriveState:
    """Return the state that a statusword (object 6041h) tells; the upper bits do not matter."""
    return _STATES[statusword & 0x7F]


def controlword(order: Order, state: DriveState) -> Controlword:
    """Return the controlword (object 6040h) that gives an order to a drive in a state."""
    if order is Order.ENABLE:
        return _UPWARD.get(state, Controlword.DISABLE_VOLTAGE)
    return _ORDERS[order]
