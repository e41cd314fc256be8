"""Loops of a transmission that are rounded otherwise than any law of the catalogue (Bouc-Wen)."""

import pytest
from test_selection import named_by_equations, recorded, SERVO, without

from servo_identify.diagnose.diagnose import diagnose
from servo_identify.diagnose.mechanisms import user_effects
from servo_twin.physics import catalogue
from servo_twin.physics.catalogue import find, register
from servo_twin.physics.servo import Placed

STIFFNESS = SERVO.numbers['mechanism.stiffness']
BOUC_WEN = '''"""Loops of Bouc and Wen with any exponent."""
from servo_twin.physics.effect import Parameter
from servo_twin.physics.ports import Mesh


class BoucWen(Mesh):
    """Bends over as it is loaded and springs back straight: beta is gamma."""

    source = 'Wen: J. Eng. Mech. Div. 102(2), 1976'
    memory = 2
    level = Parameter(1.0, 'N m', (0.0, 1e5), 'Half the height.', off=0.0)
    travel = Parameter(1e-4, 'rad', (1e-9, 10.0), 'Over which it slips.')
    exponent = Parameter(1.0, '', (0.1, 10.0), 'How late it bends over.')

    @staticmethod
    def law(p, s, motion, h):
        moved = (motion.angle - s[1]) / p.travel
        s[1] = motion.angle
        left = 1.0 - abs(s[0]) ** p.exponent if moved * s[0] > 0.0 else 1.0
        s[0] = min(max(s[0] + moved * left, -1.0), 1.0)
        return p.level * s[0]
'''


@pytest.fixture
def rig(tmp_path, monkeypatch):
    """Return a rig with loops of an exponent; the diagnosis does not know their law."""
    (tmp_path / 'bouc_wen.py').write_text(BOUC_WEN)
    monkeypatch.setattr(catalogue, '_FOREIGN', {})
    register(tmp_path)
    monkeypatch.setattr(user_effects, 'registered', list)
    return lambda exponent: SERVO.with_effects(Placed('loop', find('bouc_wen'), 'mesh'), values={
        'effects.loop.level': 10.0, 'effects.loop.travel': 25.0 / STIFFNESS,
        'effects.loop.exponent': exponent})


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize('blind', [(), ('torque',)], ids=['torque sensor', 'without'])
@pytest.mark.parametrize('exponent', [0.7, 2.0])
def test_they_are_hysteresis_and_nothing_else(rig, exponent, blind):
    several = [without(recorded(rig(exponent), seed), *blind) for seed in (1, 2)]
    assert named_by_equations(several) == {('hysteresis', 'mesh')}


@pytest.mark.long
@pytest.mark.slow
def test_what_is_handed_over_leaves_little_of_them(rig):
    several = [recorded(rig(0.7), seed) for seed in (1, 2, 3)]
    answer = diagnose(several[:1], SERVO, several[1:2], several[2:])
    assert [one.effect for one in answer.report.which] == ['hysteresis']
    assert answer.report.gap['solved'] > 0.8
