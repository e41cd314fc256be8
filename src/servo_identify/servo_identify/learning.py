"""Effects learned from recordings and put into a servo: what `fit --learn` calls."""

from __future__ import annotations

from servo_twin.physics.servo import Servo
from servo_twin.recording import Recording


def learn(what: str, servo: Servo, recordings: list[Recording]) -> tuple[Servo, list[str]]:
    """
    Learn one kind of effect; return the servo that has it and sentences for a person.

    ``what`` is friction, backlash or transmission_error. Raises ValueError where the recordings
    do not hold the experiment that it takes.
    """
    return _LEARNERS[what](servo, recordings)


def _friction(servo: Servo, recordings: list[Recording]) -> tuple[Servo, list[str]]:
    from .friction.learned import learned_friction, with_friction, with_motor_friction

    learned = learned_friction(servo, recordings)
    said = [f'{way} friction at the load: MSE {s.mse:.5f} N2 m2, MAE {s.mae:.5f} N m, '
            f'MAPE {s.mape:.3f} % on cells of angle that were kept back'
            for way, s in (('forward', learned.forward_scores),
                           ('reverse', learned.reverse_scores))]
    servo = with_friction(servo, learned)
    if servo.mechanism.compliant and all(r.has('torque') for r in recordings):
        servo, sentence = with_motor_friction(servo, recordings)
        said.append(sentence)
    return servo, said


def _backlash(servo: Servo, recordings: list[Recording]) -> tuple[Servo, list[str]]:
    from .transmission.backlash import learned_backlash, with_backlash

    learned = learned_backlash(servo, recordings)
    s = learned.scores
    return with_backlash(servo, learned), [
        f'backlash over angle and load: MSE {s.mse:.6f} arcmin2, MAE {s.mae:.5f} arcmin, '
        f'MAPE {s.mape:.3f} %; {learned.orders} low orders kept']


def _transmission_error(servo: Servo, recordings: list[Recording]) -> tuple[Servo, list[str]]:
    from .transmission.error import learned_error, with_error

    learned = learned_error(servo, recordings)
    return with_error(servo, learned), learned.sentences()


_LEARNERS = {'friction': _friction, 'backlash': _backlash,
             'transmission_error': _transmission_error}
