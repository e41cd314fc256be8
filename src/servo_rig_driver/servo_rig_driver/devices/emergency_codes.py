"""What the codes of CANopen emergency messages mean: CiA 301, table 26, and CiA 402-2, annex."""

from __future__ import annotations

CODES = {
    0x2310: 'continuous over-current at the output',
    0x2320: 'short circuit or earth leakage at the output',
    0x3210: 'over-voltage of the DC link',
    0x3220: 'under-voltage of the DC link',
    0x4210: 'the device is too hot',
    0x4310: 'the drive is too hot',
    0x7121: 'the motor is blocked',
    0x7300: 'sensor',
    0x7305: 'incremental encoder',
    0x8110: 'CAN overrun, messages were lost',
    0x8120: 'CAN in error passive mode',
    0x8130: 'heartbeat or life guarding missed',
    0x8140: 'recovered from bus off',
    0x8210: 'PDO not processed, its length is wrong',
    0x8220: 'PDO is too long',
    0x8240: 'SYNC of unexpected length',
    0x8250: 'RPDO did not come in time',
    0x8400: 'velocity controller',
    0x8500: 'position controller',
    0x8611: 'following error is too large',
    0x8700: 'SYNC did not come in time',
}
CLASSES = {
    0x10: 'generic error', 0x20: 'current', 0x21: 'current at the input',
    0x22: 'current inside the device', 0x23: 'current at the output', 0x30: 'voltage',
    0x31: 'mains voltage', 0x32: 'voltage inside the device', 0x33: 'output voltage',
    0x40: 'temperature', 0x41: 'ambient temperature', 0x42: 'temperature of the device',
    0x43: 'temperature of the drive', 0x50: 'hardware', 0x60: 'software',
    0x61: 'internal software', 0x62: 'user software', 0x63: 'data set',
    0x70: 'additional modules', 0x71: 'power', 0x73: 'sensor', 0x80: 'monitoring',
    0x81: 'communication', 0x82: 'protocol', 0x84: 'velocity controller',
    0x85: 'position controller', 0x86: 'positioning controller', 0x90: 'external error',
    0xF0: 'additional functions', 0xFF: 'of the device itself, see its manual',
}
"""By the upper byte of a code that is not listed itself."""


def words(code: int) -> str:
    """Return what an emergency code means, by its class where it is not listed itself."""
    return CODES.get(code) or CLASSES.get(code >> 8) or CLASSES.get(
        code >> 8 & 0xF0) or 'not known to CiA 301'
