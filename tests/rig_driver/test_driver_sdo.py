"""Writing an object by SDO, against frames worked out by hand from CiA 301."""

import pytest

from servo_rig_driver.devices.sdo import write_request, write_response


def test_it_writes_objects_of_two_and_four_bytes():
    # 2Bh: expedited, size told, 4 - 2 = 2 bytes unused; 1017h = 100 ms = 0064h, low byte first
    assert write_request(1, 0x1017, 100, 2) == (0x601, bytes.fromhex('2b17100064000000'))
    # 23h: none unused; 1006h = 1000 us = 03E8h
    assert write_request(3, 0x1006, 1000, 4) == (0x603, bytes.fromhex('23061000e8030000'))


def test_it_reads_what_the_node_made_of_it():
    assert write_response(bytes.fromhex('6006100000000000')) == (0x1006, None)
    assert write_response(bytes.fromhex('8006100030000906')) == (0x1006, 0x06090030)
    assert write_response(bytes.fromhex('4306100000000000')) is None
    assert write_response(b'\x60') is None


@pytest.mark.parametrize('value,size', [(70000, 2), (-1, 4), (1, 3)])
def test_it_refuses_what_does_not_fit(value, size):
    with pytest.raises(ValueError, match='does not fit'):
        write_request(1, 0x1017, value, size)
