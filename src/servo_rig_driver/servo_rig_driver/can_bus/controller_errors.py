"""
What a CAN controller says of itself, in words: error frames, and errors of the system's sockets.

Source: Linux, include/uapi/linux/can/error.h and Documentation/networking/can.rst.
"""

from __future__ import annotations

import errno

import can

TX_TIMEOUT, CONTROLLER, ACK, BUS_OFF, RESTARTED = 0x01, 0x04, 0x20, 0x40, 0x100
"""Classes of an error frame: bits of its identifier."""
OVERFLOW, WARNING, PASSIVE, ACTIVE = 0x03, 0x0C, 0x30, 0x40
"""Bits of the second byte of an error frame of class CONTROLLER."""


def controller_state(message: can.Message) -> str | None:
    """
    Return in words what an error frame says is wrong, '' where all is well again.

    None: it says nothing of how the controller is, as for one lost arbitration.
    """
    kind = message.arbitration_id
    bits = message.data[1] if kind & CONTROLLER and len(message.data) > 1 else 0
    if kind & BUS_OFF:
        return ('the CAN controller is bus-off: it met too many errors and neither sends nor '
                'hears. Look at bit rate, wiring and termination. It comes back by itself where '
                'restart-ms is set (ip link set CAN down, then ip link set CAN type can '
                'restart-ms 100, then up), else by ip link set CAN type can restart')
    if kind & (ACK | TX_TIMEOUT):
        return ('nobody acknowledges what is sent: is the cable in, the drive on, the bit rate '
                'the same?')
    if bits & PASSIVE:
        return ('the CAN controller is error-passive: it meets many errors. Look at bit rate, '
                'wiring and termination')
    if bits & WARNING:
        return 'the CAN controller meets errors; look at wiring and termination'
    if bits & OVERFLOW:
        return 'the CAN controller lost frames: the machine did not take or send them in time'
    return '' if kind & RESTARTED or bits & ACTIVE else None


_ADVICE = {
    errno.ENOBUFS: 'the queue of the controller is full, so that nobody takes what is sent: is '
                   'the cable in, the drive on, the bit rate the same? ip -details link show '
                   'tells whether it is bus-off',
    errno.ENETDOWN: 'the interface is down: ip link set {0} up type can bitrate {1}',
    errno.ENODEV: 'there is no {0}: plug the adapter in; ip link tells its name',
    errno.ENXIO: 'there is no {0}: plug the adapter in; ip link tells its name',
}


def advised(error: Exception, channel: str, bitrate: int) -> str:
    """Return an error of a socket with what to do, where it is known."""
    code = getattr(error, 'error_code', None) or getattr(error, 'errno', None)
    advice = _ADVICE.get(code or 0)
    return f'{error}; {advice.format(channel, bitrate)}' if advice else str(error)
