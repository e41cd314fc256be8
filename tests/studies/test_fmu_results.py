"""The row of paper 001's mechanism of another tool: the screw as an FMU, and built in."""

from fmu_maker import made
import numpy as np
import pytest

from servo_identify.cli import main
from servo_studies.papers.feed_drive.feed_results import sine
from servo_studies.papers.fmu import beside, brought, comparison_rows, PUSHED, two_inertias
from servo_studies.papers.paper_systems import SYSTEMS
from servo_twin.description import servo_file
from servo_twin.description.shipped import servo_at
from servo_twin.fmu import example_fmu
from servo_twin.fmu.fmu_file import FmuError
from servo_twin.physics.simulate import initial_state
from servo_twin.physics.state import ZERO

FEED_DRIVE = servo_file.load(servo_at('feed_drive'))


def test_two_inertias_give_way_as_the_screw_and_weigh_what_it_does():
    servo = two_inertias(FEED_DRIVE)
    tight = FEED_DRIVE.with_values({'effects.play.width': 0.0})
    ours, screw = (-initial_state(one, 0.0, 0.0, PUSHED)[ZERO] for one in (servo, tight))
    assert ours == pytest.approx(screw, rel=1e-9) and 1e-6 < ours < 1e-4
    v, whole = servo.values, FEED_DRIVE.values
    assert v['mechanism.rotor_inertia'] == pytest.approx(sum(
        whole[f'mechanism.{name}_inertia'] for name in ('rotor', 'coupling', 'screw')))
    assert {p.name for p in FEED_DRIVE.effects} - {p.name for p in servo.effects} == {'play'}


@pytest.mark.long
@pytest.mark.slow
def test_a_softer_fmu_is_further_from_the_built_in_one(tmp_path):
    servo = two_inertias(FEED_DRIVE)
    same = brought(servo, made(tmp_path))
    soft = same.with_values({'mechanism.stiffness': 0.5 * same.values['mechanism.stiffness']})
    found = beside(servo, {2: same, 3: soft}, sine(6000)[:800])
    near, far = found['versions'].values()
    assert near['table'] < 1e-12 and near['motor'] < 1e-9
    assert 1e-7 < far['table'] < found['travel']
    assert near['step'] > 0.0 and found['step'] > 0.0
    row, = comparison_rows(found)
    assert row['system'] in {s.name for s in SYSTEMS if s.part == 'fmu'}
    assert f'{far["table"]:.1g} m of {found["travel"]:.2g} m apart' in row['ours']


def test_without_a_c_compiler_it_says_so(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(example_fmu, 'COMPILER', 'no-such-compiler')
    example_fmu.compiled.cache_clear()
    with pytest.raises(FmuError, match="there is no C compiler 'no-such-compiler'"):
        example_fmu.made(tmp_path)
    assert main(['results', '--work', str(tmp_path / 'work'), '-o', str(tmp_path / 'results.md'),
                 '--parts', 'fmu']) == 2
    assert 'apt install gcc' in capsys.readouterr().err


def test_a_compiler_that_refuses_is_quoted(tmp_path, monkeypatch):
    made(tmp_path)  # skips without a compiler
    source = tmp_path / 'broken.c'
    source.write_text('int broken(void) { return nothing; }')
    monkeypatch.setattr(example_fmu, 'SOURCE', source)
    example_fmu.compiled.cache_clear()
    with pytest.raises(FmuError, match='broken.c: cc made no library of it'):
        example_fmu.made(tmp_path)


@pytest.mark.long
def test_the_wanted_place_is_reached_with_an_fmu(tmp_path):
    wanted = sine(6000)[:1500]
    servo = brought(two_inertias(FEED_DRIVE), made(tmp_path, 3))
    found = beside(servo, {}, wanted)
    assert found['travel'] == pytest.approx(float(np.ptp(wanted)), rel=0.05)
