"""What the evidence amounts to: a cause is named where its own balances close with it."""

from types import SimpleNamespace

import numpy as np
import pytest

from servo_identify.gap.ambiguity import Choice
from servo_identify.gap.balance import BALANCES
from servo_identify.gap.candidates import Candidate
from servo_identify.gap.completeness import Remainder
from servo_identify.gap.resimulation import Gap
from servo_identify.gap.sentence import sentence
from servo_identify.gap.status import judged
from servo_twin.physics.catalogue import find

BEFORE = 101.0  # mean square of each balance without any cause, in squares of noise and margin


def gap(rms):
    """Return a gap of one channel that moves by 1."""
    return Gap({'torque': np.array([[100.0 * rms**2, 100.0]])}, {'torque': 0.0}, {'torque': 1.0},
               np.array([0]))


def cause(name, site, *balances, effect=True, gain=1.0):
    """Return a choice: an effect, or a value beyond its tolerance."""
    candidate = Candidate(name, site, (f'effects.{name}.level',), (0,),
                          switch=0 if effect else None)
    return Choice(candidate, gain, 10.0, balances)


def remainder(balance, predictable):
    """Return what is left of a balance, of which a part follows the speed."""
    return Remainder(balance, 1.0 + predictable, predictable, ('speed',), 'odd', (), False, False,
                     None)


def evidence(choices, left, shrinks=0.8):
    """Return what a diagnosis would know: ``left`` is the predictable share by balance."""
    shown = [BALANCES.index(b) for b in left]
    return SimpleNamespace(
        stacks={'screen': SimpleNamespace(balance=np.repeat(shown, 50))},
        start=np.full(50 * len(shown), np.sqrt(BEFORE)), choices=choices, reading='',
        disputed={},
        remainders=[remainder(b, share * (BEFORE - 1.0)) for b, share in left.items()],
        reported={'base': gap(1.0), 'best': gap(1.0 - shrinks)})


@pytest.mark.parametrize(('share', 'status'), [
    (0.0, 'explained'), (0.15, 'partly_explained'), (0.4, 'unknown')])
def test_what_a_cause_leaves_says_whether_it_is_the_cause(share, status):
    """What still follows a law is at first a flaw of the cause, and then speaks against it."""
    found = judged(evidence([cause('coulomb_friction', 'load', 'load')], {'load': share}))
    assert found.status == status
    assert [one.name for one in found.named] == ['coulomb_friction'] * (status != 'unknown')


@pytest.mark.parametrize(('beside', 'share', 'names'), [
    ((), 0.01, 1), ((), 0.03, 0), (('payload_resonance',), 0.03, 2), (('gravity',), 0.1, 1)])
def test_a_value_leaves_less_behind_than_an_effect(beside, share, names):
    """A number that is put right leaves nothing, an effect beside it what its form is off."""
    value = cause('parameter:load_inertia', 'load', 'load', effect=False, gain=0.5)
    found = judged(evidence([value, *(cause(name, 'load', 'load') for name in beside)],
                            {'load': share}))
    assert len(found.named) == names


def test_an_effect_may_be_right_at_one_shaft_and_wrong_at_the_other():
    """The same name at two shafts is two causes."""
    right, wrong = (cause('coulomb_friction', site, site) for site in ('load', 'motor'))
    found = judged(evidence([right, wrong], {'load': 0.0, 'motor': 0.5}))
    assert [one.key for one in found.named] == [('coulomb_friction', 'load')]
    assert found.status == 'partly_explained'


@pytest.mark.parametrize(('left', 'torque', 'status'), [
    (0.3, 0.0, 'explained'), (0.9, 0.0, 'unknown'), (0.9, 2e-3, 'explained')])
def test_a_law_of_the_mesh_is_named_where_the_twin_winds_up_with_it_as_the_rig_does(
        left, torque, status):
    """What its torque is off by winds it up otherwise too, and says nothing of the mesh."""
    def wound(wind_up, torque):
        return Gap({'torque': np.array([[100.0 * torque**2, 100.0]]),
                    'wind_up': np.array([[100.0 * wind_up**2, 100.0]])},
                   {'torque': 0.0, 'wind_up': 1e-3}, {'torque': 1.0, 'wind_up': 1.0},
                   np.array([0]))

    bent = Candidate('nonlinear_stiffness', 'mesh', ('effects.n.soft',), (0,), switch=0,
                     effect=find('nonlinear_stiffness'))
    found = evidence([Choice(bent, 1.0, 10.0, ('transmission',))], {'transmission': 0.0})
    stiffness = 1e-3
    found.servo = SimpleNamespace(values={'mechanism.stiffness': stiffness})
    found.reported = {'base': wound(1.0, 5e-3), 'best': wound(left, torque)}
    assert judged(found).status == status


@pytest.mark.parametrize('square', (1.1, BEFORE))
def test_where_a_law_did_more_than_the_cause_there_is_a_gap_that_is_not_known(square):
    """One family may show it, where the balance as a whole is within noise and margin."""
    found = evidence([], {'motor': 0.0})
    found.start[:] = np.sqrt(square)
    assert judged(found).status == 'no_gap'
    found.disputed['motor'] = ('angle of the motor', 'current')
    told = judged(found)
    assert (told.status, told.gaps, told.worst.balance) == ('unknown', {'motor'}, 'motor')


def test_a_name_at_two_shafts_is_told_with_its_shafts():
    """A reader must see that there are two."""
    both = [cause('coulomb_friction', site, site) for site in ('load', 'motor')]
    known = evidence(both, {'load': 0.0, 'motor': 0.0})
    told = sentence(judged(known), known, 'load', 0.8)
    assert 'coulomb friction (load), coulomb friction (motor)' in told


def test_what_mends_a_wrong_cause_is_no_cause():
    """Of two in one balance that stays open the smaller one is there for the larger one."""
    large, small = (cause(name, 'load', 'load', gain=gain)
                    for name, gain in (('gravity', 5.0), ('spring_load', 1.0)))
    assert judged(evidence([large, small], {'load': 0.5})).status == 'unknown'


def test_a_twin_that_comes_no_nearer_is_explained_in_part_only():
    """Balances that close are half of an answer."""
    known = evidence([cause('coulomb_friction', 'load', 'load')], {'load': 0.0}, shrinks=-0.02)
    assert judged(known).status == 'partly_explained'


def test_without_a_cause_a_lawful_gap_is_unknown_and_noise_is_none():
    """What no law predicts is no gap, however large."""
    assert judged(evidence([], {'load': 0.5})).status == 'unknown'
    assert judged(evidence([], {'load': 0.001})).status == 'no_gap'
