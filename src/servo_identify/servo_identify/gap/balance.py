"""
The residual of every balance along what was measured, for any values and switches of a servo.

The laws are those of the twin, evaluated along the measured motion (physics.following); where an
effect is right, what it explains is gone from the residual. GAP_METHOD 'Where' names the balances.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from servo_twin.physics import state
from servo_twin.physics.following import FOLLOWED, MOTION
from servo_twin.physics.kernel import fresh_state, kernel_of
from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import substeps_of

from .controller_gains import gains_as_set
from .mesh_zero import WIND_UP, WIND_UP_RATE, zero_of
from .motion import both, Motion, motion_of
from .observation import Channels, Observation
from .weak_form import Bump

BALANCES = ('drive', 'motor', 'transmission', 'load', 'torque', 'controller')
UNITS = {'drive': 'A', 'motor': 'N m', 'transmission': 'rad', 'load': 'N m', 'torque': 'N m',
         'controller': 'V'}
FINE = ('drive', 'controller')
SENSOR_ROUNDS = 3  # a sensor effect is small against its reading: three rounds invert it


@dataclass
class Balance:
    """
    The residuals of one recording.

    ``residuals(theta, on)`` returns by balance an array over the bump's centres, in the unit of
    :data:`UNITS`; NaN where nothing can be said. A balance whose channels are missing is absent.
    """

    servo: Servo
    seen: Observation
    given: int  # how many of the servo's effects are its own; those behind are candidates
    about: np.ndarray | None = None  # values by which the zero of a gap is found
    slots: dict = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.slots = {p: s.start for p, s in self.servo.slots().items()}
        self._size = len(self.servo.theta)
        self.about = self.servo.theta if self.about is None else self.about
        self._kernel = kernel_of(self.servo)
        self._sensor_members = np.array([p.effect.port == 'sensor' and p.effect.candidate
                                         for p in self.servo.effects], dtype=bool)
        sensors = tuple(f'effects.{p.name}.' for p in self.servo.effects
                        if p.effect.port == 'sensor')
        self._of_sensors = np.array([slot for path, part in self.servo.slots().items()
                                     if path.startswith(sensors)
                                     for slot in range(part.start, part.stop)], dtype=int)
        self._last_read = None, None
        self._off = np.arange(len(self.servo.effects)) < self.given
        self._zero = 0.0 if self.has_gap else None
        self._settings, self._push = {}, 0.0
        self._governed = self.seen.closed_loop and not self._reads_unseen()
        self._static, self.meshed = self._motions(self.seen.channels)
        if self.has_gap and 'transmission' in self.names:
            self._zero = zero_of(self)
            self._static, self.meshed = self._motions(self.seen.channels)
        if 'controller' in self.names:
            self._settings = gains_as_set(self)

    @property
    def has_gap(self) -> bool:
        """Whether the mesh of the servo itself has play or a bent spring."""
        return any(p.effect.port in ('clearance', 'mesh') for p in self.servo.effects[:self.given])

    @property
    def names(self) -> tuple[str, ...]:
        """Balances that this recording's channels allow."""
        seen, names = self.seen, []
        encoders = seen.has('motor') + seen.has('load')
        if seen.has('current'):
            names.append('drive')
        if encoders and seen.has('torque'):
            names += ['motor', 'load']
        elif encoders:
            names.append('torque')
        if encoders == 2:
            names.append('transmission')
        if self._governed and encoders:
            names.append('controller')
        return tuple(names)

    def _reads_unseen(self) -> bool:
        """Tell whether the controller reads a shaft of which only the twin knows where it is."""
        channels = self.seen.channels
        if not channels.wound.any():
            return False
        other = replace(channels, wound=2.0 * channels.wound)
        return not np.array_equal(self.command_of(self.servo.theta, self._off, channels),
                                  self.command_of(self.servo.theta, self._off, other))

    def value(self, theta: np.ndarray, path: str) -> float:
        """Value of a parameter in a flat vector; 0 where the servo has no such parameter."""
        slot = self.slots.get(path)
        return 0.0 if slot is None else float(theta[slot])

    def bump_of(self, balance: str) -> Bump:
        """Bump that weighs a balance."""
        if balance == 'transmission':
            return self.seen.mesh
        return self.seen.fine if balance in FINE else self.seen.bump

    def times(self, balance: str) -> np.ndarray:
        """Instants of the residuals of a balance, s from the start of the recording."""
        bump = self.bump_of(balance)
        return bump.centres(len(self.seen.recording)) * self.seen.period

    def moving(self, balance: str) -> np.ndarray:
        """Where friction is determined: no standstill under the bump. All true for others."""
        if balance in ('motor', 'load', 'torque'):
            return self._static.moving
        if balance == 'transmission' and not self.seen.has('torque'):
            return self.meshed.moving  # what the mesh carries is what friction asks for
        return np.ones(len(self.times(balance)), dtype=bool)

    def residuals(self, theta: np.ndarray, on: np.ndarray,
                  only: tuple[str, ...] | None = None) -> dict[str, np.ndarray]:
        """Return the residuals; ``only`` limits them to some balances."""
        wanted = [n for n in self.names if only is None or n in only]
        if not wanted:
            return {}
        channels, motion, meshed = self._read(theta, on)
        current = self._current(theta, on, motion) if (
            'drive' in wanted or not self.seen.has('current')) else None
        answer = {}
        if 'drive' in wanted:
            answer['drive'] = self.seen.fine.weigh(channels.current - current)
        if 'controller' in wanted:
            answer['controller'] = self.seen.fine.weigh(
                self.seen.recording['voltage'] - self.command_of(theta, on, channels))
        if {'motor', 'load', 'torque', 'transmission'} & set(wanted):
            answer.update(self._mechanical(theta, on, motion, meshed, current, wanted))
        return answer

    @property
    def base_switches(self) -> np.ndarray:
        """Switches with every candidate off."""
        return self._off

    def motion(self, name: str) -> np.ndarray:
        """Return a column of the smooth motion (names: MOTION) over the inner samples."""
        return self._static.rows[:, MOTION.index(name)]

    def corrected_motion(self, theta: np.ndarray, on: np.ndarray) -> np.ndarray:
        """Return the smooth motion with the sensor effects taken off the readings."""
        return self._read(theta, on)[1].rows

    def series(self, name: str, balance: str = 'torque') -> np.ndarray:
        """
        Return a column of the smooth motion of a mechanical balance over the inner samples.

        ``direction`` is the sign of the speed of the load.
        """
        motion = self.meshed if balance == 'transmission' else self._static
        if name == 'direction':
            return np.sign(motion.rows[:, MOTION.index('load_speed')])
        return motion.rows[:, MOTION.index(name)]

    def weighed(self, name: str, balance: str = 'torque') -> np.ndarray:
        """Return such a column at the centres of the balance."""
        return self.under(self.series(name, balance), self.bump_of(balance))

    def model_current(self, theta: np.ndarray, on: np.ndarray) -> np.ndarray:
        """Return the current that the drive makes of the command, A, at every sample."""
        return self._current(theta, on, self._static)

    def command(self, theta: np.ndarray, on: np.ndarray) -> np.ndarray:
        """Return what the controller makes of references and readings, V, at every sample."""
        return self.command_of(theta, on, self.seen.channels)

    def command_noise(self, theta: np.ndarray) -> float:
        """Standard deviation of the controller balance by the noise of the encoders, V."""
        chance, channels = np.random.default_rng(0), self.seen.channels
        noise = self.seen.noise

        def shaken(x, name):
            return x + chance.normal(0.0, np.nan_to_num(noise[name]), len(x))

        other = Channels(shaken(channels.motor, 'motor_position'),
                         shaken(channels.load, 'load_position'), channels.torque, channels.current,
                         channels.wound)
        change = self.command_of(theta, self._off, other) - self.command(theta, self._off)
        return float(np.nanstd(self.seen.fine.weigh(change)))

    def _inner(self, full: np.ndarray) -> np.ndarray:
        reach = self.seen.bump.reach
        return full[reach:len(full) - reach]

    def under(self, series: np.ndarray, bump: Bump | None = None) -> np.ndarray:
        """Weigh what is known at the inner samples only, so that the centres agree."""
        bump = bump or self.seen.bump
        padded = np.full(len(self.seen.recording), np.nan)
        padded[bump.reach:len(padded) - bump.reach] = series
        return bump.weigh(padded)

    def follow(self, theta: np.ndarray, on: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Return what the laws say along rows of a motion: columns FOLLOWED."""
        out = np.empty((len(rows), len(FOLLOWED)))
        self._kernel.follow(theta, on, fresh_state(self._kernel), rows, out, self.seen.period)
        return out

    def _mechanical(self, theta, on, motion, meshed, current, wanted) -> dict:
        seen, rows = self.seen, motion.rows
        if current is not None and not seen.has('current'):
            rows = rows.copy()
            rows[:, MOTION.index('current')] = self._inner(current)
        answer, out = {}, None
        if meshed is motion or {'motor', 'load', 'torque'} & set(wanted):
            out = self.follow(theta, on, rows)
            answer = self._of_shafts(theta, motion, rows, out)
        if 'transmission' in wanted:
            if meshed is not motion:
                out = self.follow(theta, on, meshed.rows)
            answer['transmission'] = self._of_mesh(theta, on, meshed, out)
        return {name: answer[name] for name in wanted if name in answer}

    def _of_shafts(self, theta, motion, rows, out) -> dict:
        weighed, under = motion.weighed, self.under
        ratio = self.value(theta, 'mechanism.ratio')
        gain = self.value(theta, 'drive.torque_constant')
        rotor = self.value(theta, 'mechanism.rotor_inertia')
        inertia = self.value(theta, 'mechanism.load_inertia')
        current_at = under(rows[:, MOTION.index('current')])
        on_motor = gain * current_at + under(out[:, 0] + out[:, 1]) - rotor * weighed['motor_2']
        on_load = under(out[:, 2] + out[:, 3]) - inertia * weighed['load_2'] - weighed['external']
        if self.seen.has('torque'):
            return {'motor': on_motor - weighed['torque'] / ratio,
                    'load': on_load + weighed['torque']}
        # always at the push of the servo file, or a weaker machine would explain itself
        push = _size(gain * (current_at + self._braked(theta, rows)) + under(out[:, 0]))
        self._push = self._push or push
        return {'torque': self._push / (push or 1.0) * (ratio * on_motor + on_load)}

    def _of_mesh(self, theta, on, meshed, out) -> np.ndarray:
        """Wind-up beside what the torque makes of it, rad, by the stiffness of the servo file."""
        weighed, rows = meshed.weighed, meshed.rows

        def under(series):
            return self.under(series, self.seen.mesh)

        torque = weighed['torque'] if self.seen.has('torque') else (
            self.value(theta, 'mechanism.load_inertia') * weighed['load_2'] + weighed['external']
            - under(out[:, 2] + out[:, 3]))
        # a stiffer mesh would explain itself, were the residual not always by the one stiffness
        stiffness = self.servo.values.get('mechanism.stiffness')
        if stiffness:
            # the linear mesh is weighed as measured, only the rest goes by the smooth motion
            k = self.value(theta, 'mechanism.stiffness')
            d = self.value(theta, 'mechanism.damping')
            bent = out[:, 4] - k * rows[:, WIND_UP] - d * rows[:, WIND_UP_RATE]
            mesh = k * weighed['wind_up'] + d * weighed['wind_up_1'] + under(bent)
            return (mesh - torque) / stiffness
        compliance, relaxation = self._spring(theta)
        residual = (weighed['wind_up'] + relaxation * weighed['wind_up_1']
                    - self._lost(theta, on, rows))
        return residual - compliance * torque if compliance > 0.0 else residual

    def _braked(self, theta, rows) -> np.ndarray:
        """Current (A) at the centres that the turning motor takes off a command not measured."""
        resistance = self.value(theta, 'drive.resistance')
        if self.seen.has('current') or not resistance:
            return np.zeros(len(self.times('torque')))
        speed = self.under(rows[:, MOTION.index('motor_speed')])
        return self.value(theta, 'drive.back_emf') / resistance * speed

    def _spring(self, theta) -> tuple[float, float]:
        """Compliance (rad/(N m)) and relaxation time (s) of the spring that a rigid twin lacks."""
        behind = theta[self._size:]
        return (float(behind[0]), float(behind[1])) if len(behind) else (0.0, 0.0)

    def _lost(self, theta, on, rows) -> np.ndarray:
        """Angle lost in the teeth of a rigid mechanism, rad, at the centres."""
        out = np.empty(len(rows))
        self._kernel.lose(theta, on, fresh_state(self._kernel), rows, out, self.seen.period)
        return self.under(out, self.seen.mesh)

    def _read(self, theta, on) -> tuple[Channels, Motion, Motion]:
        """Return readings and motions with the sensor effects taken off; the last are kept."""
        used = on & self._sensor_members
        if not used.any():
            return self.seen.channels, self._static, self.meshed
        key = self._zero, used.tobytes(), theta[self._of_sensors].tobytes()
        last = self._last_read  # once: several threads may ask
        if key != last[0]:
            channels = self._corrected(self.seen.channels, theta, used)
            self._last_read = last = key, (channels, *self._motions(channels))
        return last[1]

    def _corrected(self, channels: Channels, theta, keep) -> Channels:
        """Find the readings that the sensor effects turn into those that were recorded."""
        rows = channels.as_rows()
        measured = np.isfinite(rows)
        recorded = np.where(measured, rows, 0.0)
        truth, readings = recorded.copy(), np.empty_like(recorded)
        for _ in range(SENSOR_ROUNDS):
            self._kernel.sense(theta, keep, fresh_state(self._kernel), truth, readings,
                               self.seen.period)
            truth += recorded - readings
        return Channels(*np.where(measured, truth, np.nan).T.copy(), channels.wound)

    def _current(self, theta, on, motion: Motion) -> np.ndarray:
        """Return the current that the drive makes of the command, A, at every sample."""
        samples = len(self.seen.recording)
        substeps, h = substeps_of(self.servo, self.seen.period)
        x = fresh_state(self._kernel)
        if self.seen.has('current'):
            x[state.CURRENT] = np.nan_to_num(self.seen.channels.current[0])
        current = np.empty(samples)
        self._kernel.conduct(theta, on, x, self.seen.voltage, motion.speed, current, substeps, h)
        return current

    def command_of(self, theta: np.ndarray, on: np.ndarray, channels: Channels) -> np.ndarray:
        """Return what the controller makes of references and given readings, V."""
        seen = self.seen
        references = np.column_stack((seen.column('reference_position', 0.0),
                                      seen.column('reference_velocity', 0.0)))
        ratio = self.value(theta, 'mechanism.ratio')
        motor, load = both(channels, ratio)
        command = np.empty(len(motor))
        x = fresh_state(self._kernel)
        theta = theta.copy()
        for slot, change in self._settings.items():
            theta[slot] += change
        self._kernel.govern(theta, on, x, references, motor, load, command, seen.period)
        return command

    def _motions(self, channels: Channels) -> tuple[Motion, Motion]:
        """Return the motion by which the shafts, and that by which the mesh is asked."""
        seen = self.seen
        smooth = motion_of(seen, channels, seen.bump, self.servo, self._zero)
        if seen.mesh == seen.bump:
            return smooth, smooth
        return smooth, motion_of(seen, channels, seen.mesh, self.servo, self._zero)


def _size(series: np.ndarray) -> float:
    """Root mean square of what is not missing."""
    return float(np.sqrt(np.nanmean(series**2))) if np.isfinite(series).any() else 0.0
