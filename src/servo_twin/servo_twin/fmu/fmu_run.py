"""How a servo with an FMU runs: begins it, keeps it, and says when it fails."""

from __future__ import annotations

from threading import Lock

import numpy as np

from ..physics import state
from ..physics.mechanisms.fmu import LOAD_OFFSET, MOTOR_OFFSET, TABLE, TURN
from ..physics.servo import Servo
from .fmu_file import FmuError
from .fmu_instance import Instance

_MOST = 16  # instances of one FMU in a process; the one that ran longest ago goes first

_instances: dict[str, dict[float, Instance]] = {}
_lock = Lock()


class Running:
    """
    Stands in the place of a kernel's `run` (see :mod:`..physics.rollout`), with its arguments.

    A state whose FMU has not begun begins a new instance, at the angles and speeds of the state
    where the mapping has a `start` for them. A state goes on with the instance that it left; a
    copy of it goes on too, if the FMU can return to an earlier state. In the mode observer
    nothing begins: the shafts follow the measurements. May be called from several threads.
    Raises FmuError when the FMU fails or cannot go on.
    """

    def __init__(self, run, mechanism, servo: Servo) -> None:
        self._run, self._mechanism = run, mechanism
        slots = servo.slots()
        self._given = {variable.name: slots[f'mechanism.{name}'].start
                       for name, variable in mechanism.set_by.items()}
        self._memory = servo.memories()['mechanism'].start

    def __call__(self, theta, on, x, u, y, substeps, h, mode) -> None:
        memory = x[self._memory:self._memory + self._mechanism.memory]
        if mode == state.OBSERVER and memory[TABLE] == 0.0:
            self._run(theta, on, x, u, y, substeps, h, mode)
            return
        self._check_step(h)
        instance = self._instance(theta, x, memory)
        with instance.lock:
            if memory[TURN] != instance.turn:
                instance.go_back(int(memory[TURN]))
            instance.keep()
            self._run(theta, on, x, u, y, substeps, h, mode)
            instance.turn += 1
            memory[TURN] = instance.turn
            instance.complain(x[state.TIME])

    def _check_step(self, h: float) -> None:
        fmu = self._mechanism.fmu
        if not fmu.variable_step and fmu.internal_step:
            inside = h / fmu.internal_step
            if abs(inside - round(inside)) > 1e-6 * inside or inside < 0.5:
                raise FmuError(f'{fmu.path.name}: a step of {h:g} s is no multiple of its own '
                               f'step, {fmu.internal_step:g} s; set `step` of the servo file and '
                               f'the sample period so that it is')

    def _instance(self, theta: np.ndarray, x: np.ndarray, memory: np.ndarray) -> Instance:
        """Return the instance that a state goes on with, or begin one."""
        wanted = {name: float(theta[slot]) for name, slot in self._given.items()}
        known = _instances.setdefault(self._mechanism.fmu.digest, {})
        if memory[TABLE] != 0.0:
            instance = known.get(float(memory[TABLE]))
            if instance is None:
                raise FmuError(f'{self._mechanism.fmu.path.name}: the instance of this state was '
                               f'let go; begin from an initial state')
            changed = [n for n, v in wanted.items() if instance.parameters[n] != v]
            if all(instance.tune(name, wanted[name]) for name in changed):
                with _lock:
                    known[instance.address] = known.pop(instance.address)  # the newest is last
                return instance
        return self._begin(theta, x, memory, wanted, known)

    def _begin(self, theta, x, memory, wanted, known) -> Instance:
        here = {'motor_angle': x[state.MOTOR_ANGLE], 'motor_speed': x[state.MOTOR_SPEED],
                'load_angle': x[state.LOAD_ANGLE] + x[state.ZERO],
                'load_speed': x[state.LOAD_SPEED]}
        starts = {link.variable.name: float(here[link.name]) / link.factor
                  for link in self._mechanism.starts}
        with _lock:
            most = 1 if self._mechanism.fmu.single else _MOST
            while len(known) >= most:
                known.pop(next(iter(known))).free()
        instance = Instance(self._mechanism, wanted, starts)
        with _lock:
            known[instance.address] = instance
        found = instance.outputs()
        memory[TABLE], memory[TURN] = instance.address, instance.turn
        memory[MOTOR_OFFSET] = np.nan_to_num(x[state.MOTOR_ANGLE] - found['motor_angle'])
        memory[LOAD_OFFSET] = np.nan_to_num(x[state.LOAD_ANGLE] - found['load_angle'])
        if found['torque'] == found['torque']:
            x[state.TORQUE] = found['torque']
        return instance
