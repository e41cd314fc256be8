"""A servo as a linear system: state space, transfer functions, poles, zeros and resonances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import control
import numpy as np

from ..physics.servo import Servo, ServoError
from .jacobian import felt, Matrices, matrices_of
from .operating_point import Point, Still
from .signal_names import INPUT_UNITS, OUTPUT_UNITS

_READ_BY = {'motor_speed': 'motor_position', 'load_speed': 'load_position'}
_LIGHTLY = 0.5  # damping below which a pair of roots is called a resonance


@dataclass(frozen=True)
class Root:
    """A pole or a zero: its place (1/s, continuous), frequency in Hz and damping."""

    place: complex
    frequency: float
    damping: float

    @property
    def resonant(self) -> bool:
        """Whether it is one of a lightly damped pair, above the real axis, that dies away."""
        return self.place.imag > 0.0 and 0.0 <= self.damping < _LIGHTLY


@dataclass(frozen=True)
class LinearForm:
    """
    What stands between one input and some outputs of a servo, near an operating point.

    ``system`` is a python-control StateSpace with named states, inputs and outputs in SI units,
    continuous, or of a sample period where a digital controller is in it. ``dead`` maps each
    output to a dead time in s that stands beside the system (0 where it is sampled: there it is
    in it). ``point``, ``command`` (V or A) and ``carried`` (N m) say where it holds, ``left_out``
    what of the servo is not in it and why. ``loop`` is the gain of the opened loop, if any.
    """

    servo: str
    input: str
    outputs: tuple[str, ...]
    system: control.StateSpace
    dead: dict[str, float]
    point: Point
    command: float
    carried: float
    left_out: dict[str, str]
    units: dict[str, str]
    loop: control.StateSpace | None = field(default=None, repr=False)

    def one(self, output: str) -> control.StateSpace:
        """
        Return the system to one output, of the states that it feels.

        Raises ServoError for an output that it does not have.
        """
        if output not in self.outputs:
            raise ServoError(f'{self.servo}: there is no output {output!r} in this form; there '
                             f'are {list(self.outputs)}')
        s, row = self.system, [self.outputs.index(output)]
        used = felt(s.A, s.C[row])
        names = [name for name, use in zip(s.state_labels, used, strict=True) if use]
        return control.ss(s.A[np.ix_(used, used)], s.B[used], s.C[np.ix_(row, used)], s.D[row],
                          s.dt, states=names, inputs=s.input_labels, outputs=[output],
                          remove_useless_states=False)

    def transfer(self, output: str) -> control.TransferFunction:
        """Return the transfer function to one output, without its dead time."""
        poles, zeros, gain = zeros_poles_gain(self.one(output))
        return control.tf(gain * np.poly(zeros).real, np.poly(poles).real, self.system.dt,
                          inputs=[self.input], outputs=[output])

    def poles(self, output: str) -> list[Root]:
        """Return the poles to one output, slowest first."""
        return self._roots(zeros_poles_gain(self.one(output))[0])

    def zeros(self, output: str) -> list[Root]:
        """Return the finite zeros to one output, slowest first."""
        return self._roots(zeros_poles_gain(self.one(output))[1])

    def response(self, output: str, frequency: np.ndarray, held: float = 0.0) -> np.ndarray:
        """
        Return the complex response at frequencies in Hz, dead time included.

        ``held``: period in s of a recording, whose input is held from sample to sample and whose
        samples of the output answer it; 0: as it is.
        """
        system, dead = self.one(output), self.dead[output]
        if held > 0.0 and system.isctime():
            system = control.sample_system(system, held, 'zoh')
        late = np.exp(-2j * np.pi * np.asarray(frequency, float) * dead)
        return response_of(system, frequency) * late

    def step_response(self, output: str, duration: float | None = None
                      ) -> tuple[np.ndarray, np.ndarray]:
        """Return times (s) and the answer to a step of 1 of the input, dead time included."""
        system, dead = self.one(output), self.dead[output]
        if duration is None:
            duration = self.settling(output)
        if system.isdtime(strict=True):
            time = np.arange(max(2, round(duration / system.dt))) * system.dt
        else:
            time = np.linspace(0.0, duration, 2000)
        answer = control.step_response(system, time).outputs
        late = np.interp(time - dead, time, answer, left=0.0) if dead > 0.0 else answer
        return time, late

    def settling(self, output: str) -> float:
        """Return about the time in s in which its slowest pole that dies away does so."""
        rates = [-r.place.real for r in self.poles(output) if r.place.real < -1e-6]
        return 5.0 / min(rates) if rates else 1.0

    def _roots(self, places: Sequence[complex]) -> list[Root]:
        roots = []
        for place in places:
            if self.system.isdtime(strict=True):
                place = np.log(complex(place)) / self.system.dt if place else complex(-np.inf)
            size = abs(place)
            damping = -place.real / size if size > 0.0 and np.isfinite(size) else 1.0
            roots.append(Root(complex(place), size / (2.0 * np.pi), damping))
        return sorted(roots, key=lambda r: (r.frequency, r.place.imag))


def linearise(servo: Servo, input: str, outputs: Sequence[str], point: Point) -> LinearForm:
    """
    Return the continuous linear form of a servo in open loop.

    ``input``: `voltage` (the command), `current` (of the motor, the drive left aside) or
    `external_torque` (with the command held). Raises ServoError.
    """
    check(servo, input, outputs, ('voltage', 'current', 'external_torque'))
    still = Still(servo, point, forced=input == 'current')
    matrices = matrices_of(still, (input,), tuple(outputs))
    early = still.dead.get('command', 0.0) if input == 'voltage' else 0.0
    dead = {name: early + dead_of(still, name) for name in outputs}
    return LinearForm(servo.name, input, tuple(outputs), system_of(matrices, (input,), outputs),
                      dead, point, still.command, still.carried, still.left_out,
                      units_of(servo))


def check(servo: Servo, input: str, outputs: Sequence[str], inputs: Sequence[str]) -> None:
    """Raise ServoError for an input or an output that there is not."""
    if input not in inputs:
        raise ServoError(f'{servo.name}: there is no input {input!r} here; '
                         f'there are {list(inputs)}')
    for name in outputs:
        if name not in OUTPUT_UNITS:
            raise ServoError(f'{servo.name}: there is no output {name!r}; '
                             f'there are {list(OUTPUT_UNITS)}')


def units_of(servo: Servo) -> dict[str, str]:
    """Return the unit of each input and output, in metres and newtons where it goes straight."""
    units = INPUT_UNITS | OUTPUT_UNITS
    return {name: servo.reads(unit, name) for name, unit in units.items()}


def dead_of(still: Still, output: str) -> float:
    """Return the dead time of the sensor that shows an output, s."""
    return still.dead.get(_READ_BY.get(output, output), 0.0)


def system_of(m: Matrices, inputs: Sequence[str], outputs: Sequence[str]) -> control.StateSpace:
    """Return matrices as a StateSpace with names."""
    return control.ss(m.a, m.b, m.c, m.d, states=list(m.states), inputs=list(inputs),
                      outputs=list(outputs), remove_useless_states=False)


def response_of(system: control.StateSpace, frequency: np.ndarray) -> np.ndarray:
    """Return the complex response of a system of one input and output at frequencies in Hz."""
    turn = 2j * np.pi * np.asarray(frequency, float)
    places = np.exp(turn * system.dt) if system.isdtime(strict=True) else turn
    if not len(system.A):
        return np.full(len(places), system.D[0, 0], complex)
    inside = places[:, None, None] * np.eye(len(system.A)) - system.A
    inside = np.linalg.solve(inside, np.broadcast_to(system.B, (len(places), *system.B.shape)))
    return (system.C @ inside)[:, 0, 0] + system.D[0, 0]


def zeros_poles_gain(system: control.StateSpace) -> tuple[np.ndarray, np.ndarray, float]:
    """
    Return poles, finite zeros and gain of a system of one input and one output.

    The states are scaled to what the input makes of them, and as many zeros kept as the first
    Markov parameter that is not nothing allows (Emami-Naeini, Van Dooren: Automatica 18(4), 1982,
    sec. 2). Pairs that cancel are left out.
    """
    a, b, c, d = system.A, system.B, system.C, system.D
    if not len(a):
        return np.empty(0), np.empty(0), float(d[0, 0])
    rate = max(np.abs(np.linalg.eigvals(a)).max(), 1e-12)
    a, b = a / rate, b / rate
    size = np.abs(np.linalg.solve(1j * np.eye(len(a)) * 1.1 - a, b))[:, 0]
    size = np.where(size > 0.0, size, 1.0)
    a, b, c = a * size / size[:, None], b / size[:, None], c * size
    least = 1e-9 * max(np.linalg.norm(c) * np.linalg.norm(b), abs(d[0, 0]))
    lead, power, missing = d[0, 0], b, 0
    while abs(lead) <= least and missing < len(a):
        lead, power, missing = (c @ power)[0, 0], a @ power, missing + 1
    poles = np.linalg.eigvals(a)
    if abs(lead) <= least:
        return poles * rate, np.empty(0), 0.0
    zeros = control.ss(a, b, c, d, remove_useless_states=False).zeros()
    zeros = zeros[np.isfinite(zeros)]
    zeros = zeros[np.argsort(np.abs(zeros))][:len(a) - missing]
    poles, zeros = _without_pairs(poles, zeros)
    return poles * rate, zeros * rate, float(lead * rate ** missing)


def _without_pairs(poles: np.ndarray, zeros: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return poles and zeros without those that are the same, of poles scaled to 1."""
    poles, kept = list(poles), []
    for zero in zeros:
        near = [i for i, pole in enumerate(poles) if abs(pole - zero) < 1e-7 * (abs(zero) + 1e-3)]
        if near:
            poles.pop(near[0])
        else:
            kept.append(zero)
    return np.array(poles), np.array(kept)
