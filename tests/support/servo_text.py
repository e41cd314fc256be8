"""The text of a small servo file, to be spoilt or added to."""

BENCH = """
servo: bench
drive: {type: current, gain: 0.49, torque_constant: 0.4878}
mechanism: {type: two_inertia, rotor_inertia: 1.14e-4, load_inertia: 5.76, ratio: 161.0,
            stiffness: 5.0e+5, damping: 40.0}
effects:
  bearing: {effect: coulomb_friction, at: load, level: {value: 22.0, unit: N m, source: a guess}}
"""


def changed(before: str, after: str) -> str:
    assert before in BENCH
    return BENCH.replace(before, after)
