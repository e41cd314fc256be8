"""The second rig, on which the diagnosis is tried beside the emulated one: it ..."""

from bench_second_rig import Case, diagnosed
import numpy as np
import pytest
from second_rig import record
from second_rig_machines import CLASSES
import second_rig_motions

pytestmark = pytest.mark.slow

SAMPLES = 3000


def steady(speed, **others):
    """Return the torque, N m, and the current, A, of a joint that turns at one speed, rad/s."""
    machine = CLASSES['robot joint'].machine._replace(**others)
    reference = np.full(SAMPLES, speed)
    columns = record(machine, np.cumsum(reference) * machine.period, reference,
                     np.zeros(SAMPLES), 1)
    return machine, *(float(np.mean(columns[n][SAMPLES // 2:])) for n in ('torque', 'current'))


@pytest.mark.long
@pytest.mark.parametrize('speed', [0.5, -1.5])
def test_it_needs_the_torque_of_its_friction_at_one_speed(speed):
    m, torque, current = steady(speed)
    at_load = np.sign(speed) * m.load_coulomb + m.load_viscous * speed
    at_motor = np.sign(speed) * m.motor_coulomb + m.motor_viscous * speed * m.ratio
    assert torque == pytest.approx(at_load, rel=2e-3)
    assert m.torque_constant * current == pytest.approx(at_motor + at_load / m.ratio, rel=2e-3)


def test_it_resists_more_where_something_more_resists():
    assert steady(0.5, one_way=2.0)[1] == pytest.approx(steady(0.5)[1] + 2.0, rel=2e-3)
    assert steady(-0.5, one_way=2.0)[1] == pytest.approx(steady(-0.5)[1], rel=2e-3)


@pytest.mark.long
@pytest.mark.parametrize(('machine', 'lacks', 'silent'), [
    ('gearmotor', ('gravity',), ('torque',)), ('turntable', (), ('torque', 'load_position'))])
def test_what_it_lacks_is_named_with_few_sensors_too(machine, lacks, silent, monkeypatch):
    monkeypatch.setattr(second_rig_motions, 'SECONDS', 6.0)
    assert diagnosed(Case(0, machine, lacks, False, 1, 2.0, silent))[1] == 'right'
