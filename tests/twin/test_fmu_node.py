"""A twin node whose mechanism is an FMU, fed over ROS 2."""

from fmu_maker import made
import pytest
from twin_graph import PERIOD, samples

from servo_twin.description import servo_file
from servo_twin.lockstep.twin import Twin
from servo_twin_msgs.srv import LoadServo

pytestmark = pytest.mark.ros
SERVO = """
servo: screw
drive: {{type: current, gain: 0.49, torque_constant: 0.4878}}
mechanism:
  type: fmu
  file: {fmu}
  inputs: {{motor_torque: tau_m, external_torque: tau_ext}}
  outputs: {{motor_angle: phi_m, motor_speed: w_m, load_angle: phi_l, torque: tau}}
  parameters: {{fails: fail_at, stiffness: c}}
  ratio: 20.0
  rotor_inertia: 1.0e-3
  load_inertia: 0.5
sensors: {{motor_encoder: {{}}, load_encoder: {{}}, torque_sensor: {{}}, current_sensor: {{}}}}
effects:
  bearing: {{effect: coulomb_friction, at: load, level: 1.0}}
"""


@pytest.mark.long
def test_it_answers_in_lockstep_bit_for_bit_and_outlives_a_step_that_fails(
        graph, tmp_path):
    text = SERVO.format(fmu=made(tmp_path, 2))
    rig = graph('rig').ready()
    loaded = rig.ask(LoadServo, 'twin/load_servo', LoadServo.Request(content=text))
    assert loaded.success, loaded.message
    for k in range(20):
        rig.say(10 * k, samples(10))
    rig.wait(lambda: len(rig.predictions) == 20)
    y = Twin(servo_file.loads(text), PERIOD, catch=0.0).step(0, samples(200))
    assert y[-1, 1] > 1e-3
    assert [v for m in rig.predictions for v in m.load_position] == y[:, 1].tolist()

    assert rig.set('mechanism.fails', 0.0).successful
    rig.say(200, samples(10))
    rig.wait(lambda: len(rig.predictions) == 21)
    rig.wait(lambda: any('the nut ran off its thread' in s.message for s in rig.told))
    assert rig.process.poll() is None
    refused = rig.set('mode', 'observer')
    assert not refused.successful and 'this one is an FMU' in refused.reason
