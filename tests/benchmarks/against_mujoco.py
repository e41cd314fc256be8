"""
Runs MuJoCo's sysid for bench_against.py, under an interpreter that has it.

A pendulum with a motor, armature, joint friction and damping; least squares of the position over
windows that begin in measured states and get the recorded voltage. Prints as its last line, in
JSON, the seconds that it took and its held-out error, rad.
"""

import json
from pathlib import Path
import sys
import time

try:
    import mujoco
    from mujoco import rollout, sysid
    import numpy as np

    sysid.optimize  # noqa: B018  (empty where its own requirements are missing)
except (ImportError, AttributeError):
    sys.exit(3)

RESISTANCE = 3.4  # ohm
PENDULUM = """
<mujoco>
  <option timestep="{period}" integrator="implicitfast" gravity="0 0 -9.80665">
    <flag contact="disable"/>
  </option>
  <worldbody>
    <body name="arm">
      <joint name="shaft" type="hinge" axis="0 1 0" armature="0.005" frictionloss="0.05"
             damping="0.1"/>
      <inertial pos="0 0 -0.1" mass="0.49" diaginertia="1e-9 1e-9 1e-9"/>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="shaft" gear="0.1"/></actuator>
  <sensor><jointpos name="position" joint="shaft"/></sensor>
</mujoco>
"""


def free_parameters(begin: dict) -> 'sysid.ParameterDict':
    """Return what is fitted: torque a volt, inertia, friction, damping (with the back EMF)."""
    constant = begin['drive.torque_constant']
    told = {
        'gear': (constant / RESISTANCE, 1e-3, 1.0,
                 lambda s, p: setattr(s.actuator('motor'), 'gear', [p.value[0], 0, 0, 0, 0, 0])),
        'armature': (begin['mechanism.rotor_inertia'], 1e-5, 0.05,
                     lambda s, p: setattr(s.joint('shaft'), 'armature', p.value[0])),
        'frictionloss': (begin['effects.coulomb.level'], 0.0, 0.2,
                         lambda s, p: setattr(s.joint('shaft'), 'frictionloss', p.value[0])),
        'damping': (begin['effects.viscous.slope'] + constant**2 / RESISTANCE, 0.0, 1.0,
                    lambda s, p: _damp(s.joint('shaft'), p.value[0])),
    }
    found = sysid.ParameterDict()
    for name, (value, low, high, modifier) in told.items():
        found.add(sysid.Parameter(name, nominal=value, min_value=low, max_value=high,
                                  modifier=modifier))
    return found


def _damp(joint, value: float) -> None:
    """Set the damping, which later versions hold as a row of polynomial coefficients."""
    joint.damping = np.array([value, *([0.0] * (np.size(joint.damping) - 1))]) if np.size(
        joint.damping) > 1 else value


def main() -> None:
    """Fit and print the course."""
    problem = json.loads(Path(sys.argv[1]).read_text())
    period = problem['period']
    spec = mujoco.MjSpec.from_string(PENDULUM.format(period=period))
    model = spec.compile()
    data = mujoco.MjData(model)

    def state(row: dict) -> np.ndarray:
        return sysid.create_initial_state(model, np.array([row['angle']]),
                                          np.array([row['speed']]), data.act)

    rows = problem['train']
    t = np.arange(len(rows[0]['voltage'])) * period
    sequences = sysid.ModelSequences(
        'xl330', spec, [f'window {i}' for i in range(len(rows))], [state(r) for r in rows],
        [sysid.TimeSeries(t, np.array(r['voltage'])[:, None]) for r in rows],
        [sysid.TimeSeries.from_names(t[1:], np.array(r['position'])[1:, None], model)
         for r in rows])
    parameters = free_parameters(problem['begin'])
    begun = time.perf_counter()
    residual = sysid.build_residual_fn(models_sequences=[sequences])
    fitted, _ = sysid.optimize(initial_params=parameters, residual_fn=residual, verbose=False)
    seconds = time.perf_counter() - begun

    tuned = spec.copy()
    sysid.apply_param_modifiers_spec(fitted, tuned)
    model = tuned.compile()
    squares = []
    for row in problem['held']:
        voltage = np.array(row['voltage'])[:-1, None]
        _, seen = rollout.rollout(model, mujoco.MjData(model), state(row), voltage)
        squares += [0.0, *(np.squeeze(seen) - np.array(row['position'])[1:]) ** 2]
    print(json.dumps([(seconds, float(np.sqrt(np.mean(squares))))]))


if __name__ == '__main__':
    main()
