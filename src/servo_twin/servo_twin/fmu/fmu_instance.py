"""One running instance of an FMU, and the table through which a compiled kernel calls it."""

from __future__ import annotations

from collections import deque
from copy import copy
from ctypes import c_void_p, cast
from functools import lru_cache
from threading import Lock

import numpy as np

from ..physics import fmu_calls
from ..physics.fmu_calls import GIVEN
from .fmu_file import FmuError, FmuFailure, OpenedFmu

_CALLS = {1: 'setting its inputs', 2: 'its step', 3: 'getting its outputs'}
_STATUSES = ('ok', 'warning', 'discard', 'error', 'fatal', 'pending')
_KEPT = 8  # states that can be gone back to


@lru_cache(maxsize=16)
def _library(fmu: OpenedFmu):
    """Return FMPy's face of an FMU's library, loaded, without an instance."""
    where = {'guid': fmu.guid, 'modelIdentifier': fmu.identifier,
             'unzipDirectory': str(fmu.folder), 'instanceName': fmu.identifier,
             'requireFunctions': False}  # those that are needed are asked for
    if fmu.version == 2:
        from fmpy.fmi2 import FMU2Slave
        return FMU2Slave(**where)
    from fmpy.fmi3 import FMU3Slave
    return FMU3Slave(**where)


class Instance:
    """
    An FMU from its beginning on.

    ``table`` is what the kernel calls it by, whose address is ``address``; ``turn`` counts its
    runs. Begun with parameters and starting values (by variable name, in the FMU's units); what
    it says in its log is kept for errors. Raises FmuError.
    """

    def __init__(self, mechanism, parameters: dict[str, float], starts: dict[str, float]) -> None:
        self.fmu, self.turn, self.lock = mechanism.fmu, 0, Lock()
        self.parameters = dict(parameters)
        self._said: deque[str] = deque(maxlen=3)
        self._kept: dict[int, tuple] = {}
        try:
            self._begin(mechanism, parameters, starts)
        except FmuError:
            raise
        except Exception as problem:
            raise FmuError(f'{self.fmu.path.name}: it does not begin: {problem}'
                           f'{self.said()}') from None
        self._fill(mechanism)

    @property
    def address(self) -> float:
        """Where the table is; below 2^53, so that a float holds it."""
        return float(self.table.ctypes.data)

    def said(self) -> str:
        """Return the last lines of its log, as the end of a sentence."""
        return f'; it said: {" / ".join(self._said)}' if self._said else ''

    def outputs(self) -> dict[str, float]:
        """Return what it gives now, by our names and in our units."""
        if not fmu_calls.take(self.table):
            self.complain(0.0)
        return {name: fmu_calls.output(self.table, self.numbers, i)
                for i, name in enumerate(GIVEN)}

    def complain(self, time: float) -> None:
        """Raise FmuFailure for the call that failed, if one did."""
        status = int(self.table[fmu_calls.STATUS])
        if not status:
            return
        self.table[fmu_calls.STATUS] = 0
        said = _STATUSES[status % 10] if status % 10 < len(_STATUSES) else str(status % 10)
        raise FmuFailure(f'{self.fmu.path.name}: {_CALLS[status // 10]} failed ({said}) at '
                         f't = {self.numbers[fmu_calls.CLOCK]:.9g} s of the FMU, {time:.9g} s of '
                         f'the run{self.said()}')

    def keep(self) -> None:
        """Remember this turn's state, if the FMU can."""
        if not self.fmu.returns:
            return
        while len(self._kept) >= _KEPT:
            self._forget(next(iter(self._kept)))
        self._kept[self.turn] = (self._get_state(), self.numbers.copy())

    def go_back(self, turn: int) -> None:
        """Return to the state of an earlier turn; raises FmuError where that cannot be."""
        if turn not in self._kept:
            why = (f'only the last {_KEPT} runs can be gone back to' if self.fmu.returns else
                   'the FMU does not offer to get and set its state')
            raise FmuError(f'{self.fmu.path.name}: a copy of an earlier state cannot go on: '
                           f'{why}; begin from an initial state')
        state, numbers = self._kept[turn]
        self._set_state(state)
        self.numbers[:] = numbers
        for later in [k for k in self._kept if k > turn]:
            self._forget(later)
        self.turn = turn

    def tune(self, name: str, value: float) -> bool:
        """Set a tunable parameter while it runs; returns False where it is not tunable."""
        variable = self.fmu.variables[name]
        if variable.variability != 'tunable':
            return False
        self._set([variable.reference], [value])
        self.parameters[name] = value
        return True

    def free(self) -> None:
        """Let it go."""
        for turn in list(self._kept):
            self._forget(turn)
        try:
            self._slave.terminate()
        except Exception:  # one that failed may not be terminated, but must be freed
            pass
        # FMPy's own freeInstance unloads the library, in which others may be running
        getattr(self._slave, f'fmi{self.fmu.version}FreeInstance')(self._slave.component)

    def _begin(self, mechanism, parameters: dict[str, float], starts: dict[str, float]) -> None:
        fmu = self.fmu
        self._slave = copy(_library(fmu))
        if fmu.version == 2:
            self._instantiate2()
        else:
            self._instantiate3()
        for name, value in {**parameters, **starts}.items():
            try:
                self._set([fmu.variables[name].reference], [value])
            except Exception:
                raise FmuError(f'{fmu.path.name}: {name} cannot be set to {value:g} before it '
                               f'begins{self.said()}') from None
        if fmu.version == 2:
            self._slave.setupExperiment(startTime=0.0)
            self._slave.enterInitializationMode()
        else:
            self._slave.enterInitializationMode(startTime=0.0)
        self._set([link.variable.reference for link in mechanism.inputs],
                  [0.0] * len(mechanism.inputs))
        self._slave.exitInitializationMode()

    def _instantiate2(self) -> None:
        from fmpy import calloc, fmi2, free

        def heard(environment, name, status, category, message):
            self._said.append((message or b'').decode('utf8', 'replace').strip())

        calls = fmi2.fmi2CallbackFunctions()
        self._calls = (calls, fmi2.fmi2CallbackLoggerTYPE(heard))  # kept from being collected
        calls.logger = self._calls[1]
        calls.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(calloc)
        calls.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(free)
        try:
            from ctypes import byref

            from fmpy.logging import addLoggerProxy
            addLoggerProxy(byref(calls))
        except (ImportError, OSError, AttributeError):  # then messages come without their numbers
            pass
        self._slave.instantiate(callbacks=calls)
        self._set, self._get_state = self._slave.setReal, self._slave.getFMUstate
        self._set_state, self._free_state = self._slave.setFMUstate, self._slave.freeFMUstate
        self._calls += (('fmi2DoStep', 'fmi2SetReal', 'fmi2GetReal'),)

    def _instantiate3(self) -> None:
        def heard(environment, status, category, message):
            self._said.append((message or b'').decode('utf8', 'replace').strip())

        self._slave.instantiate(logMessage=heard)
        self._set, self._get_state = self._slave.setFloat64, self._slave.getFMUState
        self._set_state, self._free_state = self._slave.setFMUState, self._slave.freeFMUState
        self._calls = (None, None, ('fmi3DoStep', 'fmi3SetFloat64', 'fmi3GetFloat64'))

    def _forget(self, turn: int) -> None:
        self._free_state(self._kept.pop(turn)[0])

    def _fill(self, mechanism) -> None:
        """Write the table and the numbers that the kernel works on."""
        slave, f = self._slave, fmu_calls
        inputs, outputs = mechanism.inputs, mechanism.outputs
        self._references = [np.array([link.variable.reference for link in links], dtype=np.uint32)
                            for links in (inputs, outputs)]
        self._scratch = np.zeros(4)
        self.numbers = np.zeros(f.NUMBERS_SIZE)
        self.numbers[f.INPUT_FACTOR:f.OUTPUT] = 1.0
        for i, link in enumerate(inputs):
            self.numbers[f.INPUT_FACTOR + i] = link.factor
        for i, link in enumerate(outputs):
            self.numbers[f.OUTPUT_FACTOR + i] = link.factor
        component = slave.component
        table = self.table = np.zeros(f.TABLE_SIZE, dtype=np.int64)
        table[f.VERSION] = self.fmu.version
        table[f.COMPONENT] = getattr(component, 'value', component)
        for place, name in zip((f.STEP, f.SET, f.GET), self._calls[2], strict=True):
            table[place] = cast(getattr(slave.dll, name), c_void_p).value
        table[f.INPUTS], table[f.OUTPUTS] = len(inputs), len(outputs)
        table[f.INPUT_REFERENCES] = self._references[0].ctypes.data
        table[f.OUTPUT_REFERENCES] = self._references[1].ctypes.data
        table[f.NUMBERS], table[f.SCRATCH] = self.numbers.ctypes.data, self._scratch.ctypes.data
        names = [link.name for link in outputs]
        table[f.SHAFTS] = 2 if 'torque' in names else 1
        for i, name in enumerate(GIVEN):
            table[f.PLACES + i] = names.index(name) if name in names else -1
