"""
The compiled step of one structure of servo.

From the parts and effects of a servo a small Python module is written, imported by name and
compiled by numba with its on-disk cache. Its file name is a digest of everything that goes into
it, so a change of any law makes another module and an old one is never taken for a new one.
Values and switches are arguments: a servo with other values, or with effects off, is the same
kernel.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
import hashlib
import importlib.util
import inspect
import os
from pathlib import Path
import sys
import textwrap
from threading import RLock
from types import FunctionType, ModuleType
from typing import Any

import numba
import numpy as np

from . import motion_evaluation, ports, rollout, state
from .effect import Parameter
from .ideal_ports import IDEAL_PORTS
from .mechanisms.fmu import Fmu
from .servo import Placed, Servo
from .servo_parts import Correction, DigitalDrive

_HEADER = '''"""Generated from the structure of a servo; do not edit."""
from collections import namedtuple
from math import exp
from numba import njit
from servo_twin.physics import catalogue, servo, servo_parts
from servo_twin.physics.mechanisms.fmu import Fmu
from servo_twin.physics.ports import Carried, Reading, Shaft, Signal, Teeth, WindUp
from servo_twin.physics.state import *
from servo_twin.physics.kernel_arrays import borrowed, own

compiled = njit(error_model='numpy', forceinline=True, no_cpython_wrapper=True,
                no_cfunc_wrapper=True)  # nobody calls them from Python: a third less to compile
'''
SLOPES = {'motor_slope': 'mesh_error_slope', 'angle_slope': 'inertia_slope'}
"""The fold of the slopes that effects have beside their law."""

_ONE = RLock()


@dataclass(frozen=True)
class Kernel:
    """
    The compiled functions of a structure.

    ``run(theta, on, x, u, y, substeps, h, mode)`` advances ``x`` in place over the samples of
    ``u``, shape (samples, len(INPUTS)), and fills ``y``, shape (samples, len(OUTPUTS)); see
    :func:`.rollout.run`. ``align(theta, on, x, torque)`` sets the zero of the torsion.
    ``evaluate_models``, ``kinematic_error``, ``drive_current``, ``sensor_readings`` and
    ``controller_output`` evaluate the laws along a measured motion, see
    :mod:`.motion_evaluation`. Each is compiled when it is first called, releases the GIL and may
    run on several threads.
    """

    run: Callable[..., Any]
    align: Callable[..., Any]
    evaluate_models: Callable[..., Any]
    kinematic_error: Callable[..., Any]
    drive_current: Callable[..., Any]
    sensor_readings: Callable[..., Any]
    controller_output: Callable[..., Any]
    state_size: int
    module: ModuleType


def kernel_of(servo: Servo) -> Kernel:
    """Return the kernel of a servo, compiled at most once for each structure."""
    rows = tuple((p, len(v)) for p, v in servo.values.items() if isinstance(v, tuple))
    with _ONE:  # another thread may be half through the import of the same
        return _kernel(_Structure(servo, (servo.drive, servo.mechanism, servo.controller,
                                          servo.sensors, servo.effects, rows)))


class _Structure:
    """A servo, compared by its structure alone."""

    def __init__(self, servo: Servo, key: tuple[object, ...]) -> None:
        self.servo, self.key = servo, key

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Structure) and self.key == other.key


@lru_cache(maxsize=128)
def _kernel(structure: _Structure) -> Kernel:
    servo = structure.servo
    text, size = _source(servo)
    digest = hashlib.sha256(text.encode())
    digest.update(numba.__version__.encode())
    here = Path(__file__).parent
    files = {Path(inspect.getfile(owner)) for _, owner in servo.owners()}
    for file in sorted(files.union(here.glob('*.py'), here.glob('mechanisms/*.py'))):
        digest.update(file.read_bytes())  # all that laws may borrow from, not the laws alone
    name = f'servo_twin_kernel_{digest.hexdigest()[:24]}'
    module = sys.modules.get(name) or _imported(name, text)
    run = servo.mechanism.running(module.run, servo)
    return Kernel(run, module.align, module.evaluate_models, module.kinematic_error,
                  module.drive_current, module.sensor_readings, module.controller_output, size,
                  module)


def cache_folder() -> Path:
    """Return the folder of generated modules: $SERVO_TWIN_CACHE or ~/.cache/servo_twin."""
    folder = Path(os.environ.get('SERVO_TWIN_CACHE') or Path.home() / '.cache' / 'servo_twin')
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _imported(name: str, text: str) -> ModuleType:
    file = cache_folder() / f'{name}.py'
    if not file.exists():
        draft = file.with_suffix(f'.{os.getpid()}')
        draft.write_text(text)
        draft.replace(file)  # another process may be writing the same: the last one wins, whole
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None and spec.loader is not None  # a .py file has both
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def _source(servo: Servo) -> tuple[str, int]:
    """Return the text of the kernel's module and the size of its state."""
    slots = servo.slots()
    ports_text, size = _ports_text(servo, slots)
    drive, mechanism, _ = starts(servo)
    parts = [_HEADER, f'THETA_SIZE, STATE_SIZE = {len(servo.theta)}, {size}\n'
             f'EFFECTS, MECHANISM = {len(servo.effects)}, {mechanism}\n']
    for kind, part in (('drive', servo.drive), ('mechanism', servo.mechanism),
                       ('controller', servo.controller), ('observer', Correction)):
        parts.append(f"{kind.title()} = namedtuple('{kind.title()}', {list(part.parameters)})\n")
        values = _values(kind, part.parameters, slots)
        body = f'    return {kind.title()}({values})' if values else f'    return {kind.title()}()'
        parts.append(f'@compiled\ndef {kind}_of(theta):\n{body}\n')
    parts.append(f"drives_own = compiled(servo.DRIVES[{_key_of('DRIVES', servo.drive)!r}].law)")
    seen = (f'x[{drive}:{mechanism}], command, x[MOTOR_ANGLE]'
            if issubclass(servo.drive, DigitalDrive) else 'x[CURRENT], command')
    parts.append('@compiled\ndef drive_law(p, x, command, speed, h):\n'
                 f'    return drives_own(p, {seen}, speed, h)\n')
    place = 'Fmu' if issubclass(servo.mechanism, Fmu) else (
        f"servo.MECHANISMS[{_key_of('MECHANISMS', servo.mechanism)!r}]")
    parts.append(f'_mechanism = {place}')
    parts.append('mechanism_rest = compiled(_mechanism.rest)')
    parts.append('mechanism_pull = compiled(_mechanism.pull)')
    law = _key_of('CONTROLLERS', servo.controller)
    parts.append(f'control_law = compiled(servo.CONTROLLERS[{law!r}].law)\n')
    parts.append(ports_text)
    parts.append(_vanishing(servo, slots))
    for name, thing in _borrowed(servo).items():
        take = f'_mechanism.step.__globals__[{name!r}]'
        take = f'compiled({take})' if isinstance(thing, FunctionType) else take
        parts.append(f'{name} = {take}')
    step = _plain(servo.mechanism.step).replace('def step(', 'def advance(', 1)
    parts.append('\n@compiled\n' + step)
    along = motion_evaluation
    for function in (rollout.align, rollout.run, along.evaluate_models, along.kinematic_error,
                     along.drive_current, along.sensor_readings, along.controller_output):
        parts.append('@njit(error_model="numpy", nogil=True, cache=True, no_cfunc_wrapper=True)\n'
                     + _plain(function))
    return '\n'.join(parts), size


def starts(servo: Servo) -> tuple[int, int, int]:
    """Return where in the state the memories of drive, mechanism and effects begin."""
    mechanism = state.PARTS + servo.drive.memory
    return state.PARTS, mechanism, mechanism + servo.mechanism.memory


def _key_of(registry: str, part: type) -> str:
    from . import servo as module
    parts: dict[str, type] = getattr(module, registry)
    return next(k for k, v in parts.items() if v is part)


def _plain(function: Callable[..., Any]) -> str:
    return textwrap.dedent(inspect.getsource(function)).replace('@staticmethod\n', '', 1)


def _borrowed(servo: Servo) -> dict[str, Any]:
    """Return what the mechanism's step uses from its own file, besides ports and the header's."""
    step = servo.mechanism.step
    assert isinstance(step, FunctionType)
    known = ({f.__name__ for f in IDEAL_PORTS.values()} | set(vars(state)) | set(vars(ports))
             | {'mechanism_pull'})
    return {n: step.__globals__[n] for n in step.__code__.co_names
            if n in step.__globals__ and n not in known}


def _values(path: str, parameters: Mapping[str, Parameter], slots: dict[str, slice]) -> str:
    taken = []
    for name, parameter in parameters.items():
        slot = slots[f'{path}.{name}']
        taken.append(f'theta[{slot.start}:{slot.stop}]' if parameter.row
                     else f'theta[{slot.start}]')
    return ', '.join(taken)


def _ports_text(servo: Servo, slots: dict[str, slice]) -> tuple[str, int]:
    """Write the sum or the chain of effects of each port at each site."""
    texts, memory = [], starts(servo)[2]
    members: dict[tuple[str, str], list[str]] = {key: [] for key in IDEAL_PORTS}
    for index, placed in enumerate(servo.effects):
        effect = placed.effect
        texts.append(f"Values{index} = namedtuple('Values{index}', {list(effect.parameters)})")
        texts.append(f'law{index} = compiled(catalogue.find({effect.name!r}).law)')
        values = _values(f'effects.{placed.name}', effect.parameters, slots)
        memories = f'x[{memory}:{memory + effect.memory}]' if effect.memory else '()'
        memory += effect.memory
        call = f'law{index}(Values{index}({values}), {memories}, motion, h)'
        members[effect.port, placed.site].append(_member(index, placed, call))
        for slope, fold in SLOPES.items():
            if hasattr(effect, slope):
                texts.append(f'slope{index} = compiled(catalogue.find({effect.name!r}).{slope})')
                members[fold, placed.site].append(
                    _member(index, placed, f'slope{index}(Values{index}({values}), motion)'))
    for key, port in IDEAL_PORTS.items():
        chain = key[0] in ('drive', 'sensor')
        start = 'motion.value' if chain else '0.0'
        lines = ''.join(members[key])
        texts.append(f'\n@compiled\ndef {port.__name__}(theta, on, x, motion, h):\n'
                     f'    total = {start}\n{lines}    return total\n')
    return '\n'.join(texts), memory


def _vanishing(servo: Servo, slots: dict[str, slice]) -> str:
    """
    Write what switches off the effects whose every amplitude is off, so that they cost nothing.

    Not those with a memory: it has to be right when the values change.
    """
    lines = []
    for index, placed in enumerate(servo.effects):
        seen = []
        for name in () if placed.effect.memory else placed.effect.amplitudes():
            slot, off = slots[f'effects.{placed.name}.{name}'], placed.effect.parameters[name].off
            seen += [f'(theta[{k}] != {off!r})' for k in range(slot.start, slot.stop)]
        if seen:
            lines.append(f'    on[{index}] &= {" | ".join(seen)}\n')
    return f'@compiled\ndef switch_off_vanished(theta, on):\n{"".join(lines)}    return\n'


def _member(index: int, placed: Placed, call: str) -> str:
    if placed.effect.combine == 'order':
        rest = ', '.join(f'motion.{f}' for f in placed.effect.motion._fields[1:])
        motion = placed.effect.motion.__name__
        return (f'    if on[{index}]:\n        total = {call}\n'
                f'        motion = {motion}(total, {rest})\n')
    return f'    if on[{index}]:\n        total += {call}\n'


def fresh_state(kernel: Kernel) -> np.ndarray:
    """Return a state at rest at zero, shape (state_size,)."""
    x = np.zeros(kernel.state_size)
    x[state.MOTOR_DIRECTION] = x[state.LOAD_DIRECTION] = 1.0
    x[state.COUPLED] = np.nan
    return x
