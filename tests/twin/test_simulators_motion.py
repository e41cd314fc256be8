"""The twin of a joint of a simulator moves as the simulator moves it."""

from mujoco_pendulum import pendulum
import numpy as np
import pytest

mujoco = pytest.importorskip('mujoco')

from servo_twin.physics.drives import VoltageDrive  # noqa: E402
from servo_twin.physics.simulate import initial_state, inputs_of, simulate  # noqa: E402
from servo_twin.physics.state import INPUTS  # noqa: E402
from servo_twin.simulators.from_model.as_servo import servo_of  # noqa: E402
from servo_twin.simulators.from_model.mujoco_joint import joint_of  # noqa: E402


def by_mujoco(model, name, control, start=0.2):
    """Return the positions of j over a control of one actuator, a sample a timestep."""
    data = mujoco.MjData(model)
    place = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
    data.qpos[0] = start
    found = np.empty(len(control))
    for k, value in enumerate(control):
        found[k] = data.qpos[0]
        data.ctrl[place] = value
        mujoco.mj_step(model, data)
    return found


@pytest.mark.long
@pytest.mark.parametrize(('actuators', 'joint', 'column'), [
    ('<motor name="a" joint="j" gear="9" ctrlrange="-1 1"/>',
     'armature="0.05" damping="0.4" stiffness="2" springref="0.3"', 'voltage'),
    ('<position name="a" joint="j" kp="60" kv="3" forcerange="-4 4"/>',
     'armature="0.05" damping="0.4"', 'reference_position'),
    ('<velocity name="a" joint="j" kv="5"/>', 'armature="0.05"', 'reference_velocity'),
    ('<general name="a" joint="j" gainprm="2" biastype="affine" biasprm="0 0 -0.8"/>',
     'armature="0.05"', 'voltage'),
    ('<general name="a" joint="j" gainprm="4" dyntype="filterexact" dynprm="0.05"/>',
     'damping="0.3"', 'voltage'),
])
def test_its_twin_moves_as_mujoco_moves_it(actuators, joint, column):
    step = 1e-4
    model = pendulum(actuators, joint, step=step)
    servo, _ = servo_of(joint_of(model, 'j', 'x'), 'servo')
    t = np.arange(15000) * step
    control = 0.6 * np.sin(5.0 * t) + 0.5 * np.sin(13.0 * t)
    truth = by_mujoco(model, 'a', control)
    columns = {name: np.full(len(t), np.nan) for name in INPUTS} | {column: control}
    mode = 'measured_input' if column == 'voltage' else 'closed_loop'
    y = simulate(servo, inputs_of(columns), step, initial_state(servo, load=0.2), mode)
    assert np.ptp(truth) > 0.05
    assert np.abs(y[:, 1] - truth).max() < 2e-3 * np.ptp(truth)


@pytest.mark.long
@pytest.mark.skipif(not hasattr(mujoco.mjtGain, 'mjGAIN_DCMOTOR'), reason='no dcmotor')
@pytest.mark.parametrize('beside', ['cogging="0.01 6 0.3"', 'lugre="2 0.002 0.02 0.03 4"'])
def test_the_twin_of_a_dcmotor_moves_as_mujoco_moves_it(beside):
    step = 1e-4
    model = pendulum('<dcmotor name="a" joint="j" resistance="2" motorconst="0.05 0.05" gear="20" '
                     f'inductance="0.004 0" armature="1e-4" {beside}/>', 'damping="0.3"',
                     step=step)
    servo, lacking = servo_of(joint_of(model, 'j', 'x'), 'servo')
    assert servo.drive is VoltageDrive and not lacking
    assert servo.values['mechanism.ratio'] == 20.0
    assert servo.values['drive.inductance'] == pytest.approx(0.004)
    t = np.arange(15000) * step
    control = 4.0 * np.sin(5.0 * t) + 6.0 * np.sin(13.0 * t)
    truth = by_mujoco(model, 'a', control, start=0.0)
    columns = {name: np.full(len(t), np.nan) for name in INPUTS} | {'voltage': control}
    y = simulate(servo, inputs_of(columns), step, initial_state(servo))
    assert np.abs(y[:, 1] - truth).max() < 3e-3 * np.ptp(truth)
