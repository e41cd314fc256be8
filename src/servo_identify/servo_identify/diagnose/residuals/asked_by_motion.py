"""Torque and current that the measured motion asks for, beside what an explanation has found."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from servo_twin.balances.equation_terms import rotor_inertia
from servo_twin.physics.motion_evaluation import EVALUATED

from .along_motion import AlongMotion
from .motion import bridged


class AskedByMotion(AlongMotion):
    """One recording and what its motion asks for of load, motor and drive."""

    @cached_property
    def predicted_load(self) -> np.ndarray:
        """
        Torque that the motion asks of the transmission, N m at the inner samples.

        It is what the load equation says without the torque sensor. Effects that depend on the
        load are evaluated with it: a regressor that is the measured torque itself would explain
        its own noise, and any friction as a loss of itself (instrumental variables: Janot,
        Vandanjon, Gautier 2014). So it leaves out friction that an explanation put there: where
        friction is most of the torque, each friction would be a share of itself.
        """
        return self._known_load - (self._found('load_torque') - self._found('load_resistance'))

    @cached_property
    def carried_load(self) -> np.ndarray:
        """The same without friction of the load that the file has: what gears carry, N m."""
        return self.predicted_load + self.of_file['load_resistance']

    @cached_property
    def _known_load(self) -> np.ndarray:
        """The same by the servo file alone, without what an explanation adds."""
        motion, values, out = self.motion, self.servo.numbers, self.of_file
        own = values['mechanism.load_inertia'] * motion['load_acceleration']
        return own + motion['external'] - out['load_push'] - out['load_resistance']

    @cached_property
    def predicted_current(self) -> np.ndarray:
        """Current that the motion asks of the motor, A at the inner samples; see above."""
        return self._asked(self.predicted_load - self._found('load_resistance'),
                           self._found('motor_torque'))

    @cached_property
    def driving_current(self) -> np.ndarray:
        """
        Current that the file asks for, with what was found at the motor, A at the inner samples.

        What ripples with the current shows by it. Friction and load that an explanation put there
        are left out.
        """
        return self._asked(self._known_load,
                           self._found('motor_torque') - self._found('motor_resistance'))

    @cached_property
    def saturating_current(self) -> np.ndarray:
        """
        Current that the file asks for, with what the current was found to lose, A, inner samples.

        Torque that is lost over the current shows by it. Friction, load and cogging that an
        explanation put there are left out: a motor that loses nearly all of its torque would
        explain them.
        """
        return self._asked(self._known_load, self._found('motor_lost'))

    @cached_property
    def known_current(self) -> np.ndarray:
        """
        Current that the motion asks for by the servo file alone, A at the inner samples.

        What scales a current (torque constant, gain of its sensor) shows by it: what an
        explanation adds is scaled too, and its free amplitude has that already. Were it part of
        the regressor, any friction would be explained by a motor without torque.
        """
        return self._asked(self._known_load, np.zeros(()))

    @property
    def known_beside_gap(self) -> np.ndarray:
        """Torque on the load that was found beside a clearance, N m at the inner samples."""
        return self._found('load_torque_beside_gap') + np.zeros(len(self.motion.rows))

    def _asked(self, load: np.ndarray, more: np.ndarray) -> np.ndarray:
        """Current, A, for a torque of the load and ``more`` on the motor, N m, inner samples."""
        motion, values, out = self.motion, self.servo.numbers, self.of_file
        lever = values['mechanism.ratio'] * values.get('mechanism.efficiency', 1.0)
        felt = self.transmitted() if 'torque' in self.measured.channels else load
        speed_up = motion.test.smooth(bridged(self.angles()[0]), 2)
        torque = (rotor_inertia(values) * speed_up + felt / lever
                  - out['motor_push'] - out['motor_resistance'] - more)
        return torque / values['drive.torque_constant']

    def _found(self, signal: str) -> np.ndarray:
        """Return what an explanation adds to a signal at the inner samples."""
        if signal not in self.unseen:
            return np.zeros(())
        return self.inner(np.nan_to_num(self.unseen[signal]))

    @cached_property
    def regressor_command(self) -> np.ndarray:
        """
        Command by which models of the drive are evaluated, V at every sample.

        Where the current is measured, the command explains it. Where it is not, the command is the
        force that the motion explains: then it is the one that the motion asks for.
        """
        command = self.measured.column('voltage', 0.0)
        if 'current' in self.measured.channels:
            return command
        values, motion = self.servo.numbers, self.motion
        current, speed = self.predicted_current, motion['motor_speed']
        gain = values.get('drive.gain', 1.0) or 1.0
        if 'drive.resistance' in values:
            loop = values['drive.resistance'] + values.get('drive.proportional', 0.0)
            current = loop * current + values.get('drive.back_emf', 0.0) * speed
            gain *= values.get('drive.proportional') or 1.0
        asked = self.full(current / gain)
        return np.where(np.isfinite(asked), asked, command)

    @cached_property
    def driven_current(self) -> np.ndarray:
        """Current that the drive of the file makes of that command, A at every sample."""
        return self.drive_current(self.servo.theta, self.regressor_command)

    @cached_property
    def of_file(self) -> dict[str, np.ndarray]:
        """What the models of the servo file say along the motion, by the names of EVALUATED."""
        out = self.evaluated(self.servo.theta, self.motion)
        return dict(zip(EVALUATED, out.T, strict=True))
