"""A servo over an excitation: its own twin, from rest."""

from __future__ import annotations

import numpy as np

from ...physics.servo import Servo
from ...physics.simulate import initial_state, inputs_of, simulate
from ...physics.state import INPUTS
from .joint_excitation import Excitation


def twin_run(servo: Servo, excitation: Excitation, on: np.ndarray | None = None) -> np.ndarray:
    """
    Return what a servo's sensors read over an excitation, shape (samples, len(OUTPUTS)).

    In closed loop where the excitation is a reference. ``on`` switches effects off.
    """
    count = len(excitation.time)
    columns = {name: np.full(count, np.nan) for name in INPUTS} | excitation.columns()
    mode = 'measured_input' if excitation.kind == 'command' else 'closed_loop'
    x = initial_state(servo, load=excitation.start, on=on)
    return simulate(servo, inputs_of(columns), excitation.period, x, mode, on=on)
