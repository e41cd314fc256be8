"""
The residual of every balance along what was measured, for any values and switches of a servo.

The laws are those of the twin, evaluated along the measured motion (physics.following); where an
effect is right, what it explains is gone from the residual. GAP_METHOD 'Where' names the balances.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import least_squares

from servo_twin.physics import state
from servo_twin.physics.following import FOLLOWED, MOTION
from servo_twin.physics.kernel import fresh_state, kernel_of
from servo_twin.physics.servo import Servo
from servo_twin.physics.simulate import substeps_of

from .motion import both, Motion, motion_of
from .observation import Channels, Observation
from .weak_form import Bump

BALANCES = ('drive', 'motor', 'transmission', 'load', 'torque', 'controller')
UNITS = {'drive': 'A', 'motor': 'N m', 'transmission': 'rad', 'load': 'N m', 'torque': 'N m',
         'controller': 'V'}
WIND_UP, WIND_UP_RATE = MOTION.index('wind_up'), MOTION.index('wind_up_rate')
FINE = ('drive', 'controller')
ZERO_STEP = 0.002  # share of the range of the wind-up by which its zero is tried
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
    _slots: dict = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._slots = {p: s.start for p, s in self.servo.slots().items()}
        self._size = len(self.servo.theta)
        self._about = self.servo.theta if self.about is None else self.about
        self._kernel = kernel_of(self.servo)
        self._sensor_members = np.array([p.effect.port == 'sensor' and p.effect.candidate
                                         for p in self.servo.effects], dtype=bool)
        self._off = np.arange(len(self.servo.effects)) < self.given
        self._zero, self._settings, self._push = 0.0, {}, 0.0
        self._static, self._meshed = self._motions(self.seen.channels)
        if self.has_gap and self.seen.has('torque') and 'transmission' in self.names:
            self._zero = self._centre()
            self._static, self._meshed = self._motions(self.seen.channels)
        if 'controller' in self.names:
            self._settings = self._as_set()

    def _as_set(self) -> dict[int, float]:
        """
        Find the gains of this recording, within their tolerance: gains are settings.

        Returns by slot of theta how far they are from those of the servo file. Found by the law
        itself and not by its slope, since a gain that is far off drives the law into its limit.
        """
        paths = [p for p in self.servo.tolerance if p.startswith('controller.')]
        if not paths:
            return {}
        nominal = np.array([self.servo.values[p] for p in paths])
        low, high = np.array([self.servo.tolerance[p] for p in paths]).T
        slots = [self._slots[p] for p in paths]
        scale = np.maximum(high - low, 1e-12)
        measured = self.seen.recording['voltage']

        def misfit(x):
            theta = self.servo.theta
            theta[slots] = x * scale
            left = measured - self._command(theta, self._off, self.seen.channels)
            left = self.seen.fine.weigh(left)
            return np.nan_to_num(left - np.nanmedian(left))  # the integral may have begun anywhere

        tries = [least_squares(misfit, start / scale, bounds=(low / scale, high / scale),
                               loss='soft_l1', f_scale=0.01 * np.nanstd(measured) + 1e-9,
                               diff_step=1e-3, max_nfev=20)
                 for start in (np.clip(nominal, low, high), 0.5 * (low + high),
                               low + 0.1 * (high - low))]
        best = min(tries, key=lambda found: found.cost)
        return dict(zip(slots, best.x * scale - nominal, strict=True))

    def kinks(self) -> np.ndarray:
        """
        Return at the centres by how much a bent mesh law is blurred by the bump, rad.

        The law of the mean wind-up is not the mean of the law where the wind-up runs through a
        kink within the bump; there the balance knows no better. Zero for a linear mesh.
        """
        stiffness = self.servo.values.get('mechanism.stiffness')
        if not stiffness or not self.has_gap:
            return np.zeros(len(self.times('transmission')))
        rows, theta = self._meshed.rows, self._about
        damping = self.value(theta, 'mechanism.damping')
        bent = self._follow(theta, self._off, rows)[:, 4] - stiffness * rows[:, WIND_UP]
        bent -= damping * rows[:, WIND_UP_RATE]
        bump, reach = self.seen.mesh, self.seen.mesh.reach
        at = np.clip(bump.centres(len(self.seen.recording)) - reach, 0, len(bent) - 1)
        return np.abs(np.nan_to_num(self._under(bent, bump) - bent[at])) / stiffness

    def slope_of_zero(self) -> np.ndarray:
        """
        Return at the centres what the transmission's residual gains by one rad of its zero.

        One for a linear mesh. Inside a gap nothing is wound up, wherever the zero is.
        """
        stiffness = self.servo.values.get('mechanism.stiffness')
        if not stiffness or not self.has_gap:
            return np.ones(len(self.times('transmission')))
        rows, theta = self._meshed.rows.copy(), self._about
        shift = ZERO_STEP * float(np.ptp(rows[:, WIND_UP]))
        rows[:, WIND_UP] += shift
        pull = self._follow(theta, self._off, rows)[:, 4]
        rows[:, WIND_UP] -= 2.0 * shift
        pull -= self._follow(theta, self._off, rows)[:, 4]
        return self._under(pull, self.seen.mesh) / (2.0 * shift * stiffness)

    @property
    def has_gap(self) -> bool:
        """Whether the mesh of the servo itself has play or a bent spring."""
        return any(p.effect.port in ('clearance', 'mesh') for p in self.servo.effects[:self.given])

    def _centre(self) -> float:
        """
        Find the zero of the wind-up beside its median, rad: the one that explains the torque best.

        A gap or a bent spring is not the same from another zero; a straight one does not care.
        """
        theta = self._about
        span = float(np.ptp(np.percentile(self.motion('wind_up'), (2, 98))))
        rows = self._meshed.rows[:: max(1, len(self._meshed.rows) // 4000)].copy()
        torque, wound = rows[:, MOTION.index('torque')], rows[:, WIND_UP].copy()

        def misfit(shift):
            rows[:, WIND_UP] = wound - shift
            return float(np.mean(np.abs(self._follow(theta, self._off, rows)[:, 4] - torque)))

        best, width = 0.0, 0.5 * span
        for _ in range(4):
            tried = best + np.linspace(-width, width, 11)
            best, width = float(tried[np.argmin([misfit(t) for t in tried])]), 0.2 * width
        return best

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
        if seen.closed_loop and encoders:
            names.append('controller')
        return tuple(names)

    def value(self, theta: np.ndarray, path: str) -> float:
        """Value of a parameter in a flat vector; 0 where the servo has no such parameter."""
        slot = self._slots.get(path)
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
            return self._meshed.moving  # what the mesh carries is what friction asks for
        return np.ones(len(self.times(balance)), dtype=bool)

    def residuals(self, theta: np.ndarray, on: np.ndarray,
                  only: tuple[str, ...] | None = None) -> dict[str, np.ndarray]:
        """Return the residuals; ``only`` limits them to some balances."""
        wanted = [n for n in self.names if only is None or n in only]
        if not wanted:
            return {}
        channels, motion, meshed = self.seen.channels, self._static, self._meshed
        if (on & self._sensor_members).any():
            channels = self._corrected(channels, theta, on)
            motion, meshed = self._motions(channels)
        current = self._current(theta, on, motion) if (
            'drive' in wanted or not self.seen.has('current')) else None
        answer = {}
        if 'drive' in wanted:
            answer['drive'] = self.seen.fine.weigh(channels.current - current)
        if 'controller' in wanted:
            answer['controller'] = self.seen.fine.weigh(
                self.seen.recording['voltage'] - self._command(theta, on, channels))
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
        if not (on & self._sensor_members).any():
            return self._static.rows
        return self._motions(self._corrected(self.seen.channels, theta, on))[0].rows

    def weighed(self, name: str, balance: str = 'torque') -> np.ndarray:
        """Return a column of the smooth motion at the centres of a mechanical balance."""
        motion = self._meshed if balance == 'transmission' else self._static
        return self._under(motion.rows[:, MOTION.index(name)], self.bump_of(balance))

    def model_current(self, theta: np.ndarray, on: np.ndarray) -> np.ndarray:
        """Return the current that the drive makes of the command, A, at every sample."""
        return self._current(theta, on, self._static)

    def command(self, theta: np.ndarray, on: np.ndarray) -> np.ndarray:
        """Return what the controller makes of references and readings, V, at every sample."""
        return self._command(theta, on, self.seen.channels)

    def command_noise(self, theta: np.ndarray) -> float:
        """Standard deviation of the controller balance by the noise of the encoders, V."""
        chance, channels = np.random.default_rng(0), self.seen.channels
        noise = self.seen.noise

        def shaken(x, name):
            return x + chance.normal(0.0, np.nan_to_num(noise[name]), len(x))

        other = Channels(shaken(channels.motor, 'motor_position'),
                         shaken(channels.load, 'load_position'), channels.torque, channels.current)
        change = self._command(theta, self._off, other) - self._command(theta, self._off, channels)
        return float(np.nanstd(self.seen.fine.weigh(change)))

    def _inner(self, full: np.ndarray) -> np.ndarray:
        reach = self.seen.bump.reach
        return full[reach:len(full) - reach]

    def _under(self, series: np.ndarray, bump: Bump | None = None) -> np.ndarray:
        """Weigh what is known at the inner samples only, so that the centres agree."""
        bump = bump or self.seen.bump
        padded = np.full(len(self.seen.recording), np.nan)
        padded[bump.reach:len(padded) - bump.reach] = series
        return bump.weigh(padded)

    def _follow(self, theta, on, rows) -> np.ndarray:
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
            out = self._follow(theta, on, rows)
            answer = self._of_shafts(theta, motion, rows, out)
        if 'transmission' in wanted:
            if meshed is not motion:
                out = self._follow(theta, on, meshed.rows)
            answer['transmission'] = self._of_mesh(theta, on, meshed, out)
        return {name: answer[name] for name in wanted if name in answer}

    def _of_shafts(self, theta, motion, rows, out) -> dict:
        weighed, under = motion.weighed, self._under
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
            return self._under(series, self.seen.mesh)

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
        speed = self._under(rows[:, MOTION.index('motor_speed')])
        return self.value(theta, 'drive.back_emf') / resistance * speed

    def _spring(self, theta) -> tuple[float, float]:
        """Compliance (rad/(N m)) and relaxation time (s) of the spring that a rigid twin lacks."""
        behind = theta[self._size:]
        return (float(behind[0]), float(behind[1])) if len(behind) else (0.0, 0.0)

    def _lost(self, theta, on, rows) -> np.ndarray:
        """Angle lost in the teeth of a rigid mechanism, rad, at the centres."""
        out = np.empty(len(rows))
        self._kernel.lose(theta, on, fresh_state(self._kernel), rows, out, self.seen.period)
        return self._under(out, self.seen.mesh)

    def _corrected(self, channels: Channels, theta, on) -> Channels:
        """Find the readings that the sensor effects turn into those that were recorded."""
        rows = channels.as_rows()
        measured = np.isfinite(rows)
        recorded = np.where(measured, rows, 0.0)
        truth, readings = recorded.copy(), np.empty_like(recorded)
        keep = on & self._sensor_members
        for _ in range(SENSOR_ROUNDS):
            self._kernel.sense(theta, keep, fresh_state(self._kernel), truth, readings,
                               self.seen.period)
            truth += recorded - readings
        return Channels(*np.where(measured, truth, np.nan).T.copy())

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

    def _command(self, theta, on, channels: Channels) -> np.ndarray:
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
