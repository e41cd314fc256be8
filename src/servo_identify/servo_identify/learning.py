"""Effects learned from recordings and put into a servo: what `fit --learn` calls."""

from __future__ import annotations

from collections.abc import Callable

from servo_twin.physics.servo import Servo
from servo_twin.recording import Recording

Told = Callable[[float, float], None]
"""Is given the share that is done, at least (training stops early), and the loss."""


def learn(what: str, servo: Servo, recordings: list[Recording], told: Told | None = None
          ) -> tuple[Servo, list[str]]:
    """
    Learn one kind of effect; return the servo that has it and sentences for a person.

    ``what`` is friction, backlash or transmission_error; the loss that is ``told`` is the mean
    square error on what is kept back, in N2 m2, arcmin2 and arcmin2. Raises ValueError where the
    recordings do not hold the experiment that it takes.
    """
    return _LEARNERS[what](servo, recordings, told or (lambda share, loss: None))


def _friction(servo: Servo, recordings: list[Recording], told: Told) -> tuple[Servo, list[str]]:
    from .friction.learned import learned_friction, with_friction, with_motor_friction
    from .friction.network import ITERATIONS

    networks = -1

    def heard(iteration: int, _: float, kept: float) -> None:
        nonlocal networks
        networks += iteration == 0
        told(0.5 * (networks + iteration / ITERATIONS), kept)

    learned = learned_friction(servo, recordings, told=heard)
    said = [f'{way} friction at the load: MSE {s.mse:.5f} N2 m2, MAE {s.mae:.5f} N m, '
            f'MAPE {s.mape:.3f} % on cells of angle that were kept back'
            for way, s in (('forward', learned.forward_scores),
                           ('reverse', learned.reverse_scores))]
    servo = with_friction(servo, learned)
    if servo.mechanism.compliant and all(r.has('torque') for r in recordings):
        servo, sentence = with_motor_friction(servo, recordings)
        said.append(sentence)
    return servo, said


def _backlash(servo: Servo, recordings: list[Recording], told: Told) -> tuple[Servo, list[str]]:
    from .transmission.backlash import ITERATIONS, learned_backlash, with_backlash

    learned = learned_backlash(servo, recordings, told=lambda iteration, _, kept: told(
        iteration / ITERATIONS, kept))
    s = learned.scores
    return with_backlash(servo, learned), [
        f'backlash over angle and load: MSE {s.mse:.6f} arcmin2, MAE {s.mae:.5f} arcmin, '
        f'MAPE {s.mape:.3f} %; {learned.orders} low orders kept']


def _transmission_error(servo: Servo, recordings: list[Recording], told: Told
                        ) -> tuple[Servo, list[str]]:
    from .transmission.error import learned_error, with_error

    learned = learned_error(servo, recordings)
    told(1.0, max(s.mse for s in learned.scores))
    return with_error(servo, learned), learned.sentences()


_LEARNERS = {'friction': _friction, 'backlash': _backlash,
             'transmission_error': _transmission_error}
