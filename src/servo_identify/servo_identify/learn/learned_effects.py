"""Effects learned from recordings and put into a servo: what `fit --learn` calls."""

from __future__ import annotations

from collections.abc import Callable

from servo_twin.physics.servo import Servo
from servo_twin.recording.recording import Recording

Told = Callable[[float, float], None]
"""Is given the share that is done, at least (training stops early), and the loss."""


def learn(what: str, servo: Servo, recordings: list[Recording], told: Told | None = None
          ) -> tuple[Servo, list[str]]:
    """
    Learn one kind of effect; return the servo that has it and sentences for a person.

    ``what`` is friction, backlash, transmission_error, current_loop, presliding, residual or
    deviation. The loss that is ``told`` is the mean square error on what is kept back. Its units
    are, in this order, N2 m2, arcmin2, arcmin2, A2 (of all), 1 - R of free runs, N2 m2, and rad2
    (or m2) at the load. Raises ValueError where the recordings do not hold the experiment that it
    takes.
    """
    return _LEARNERS[what](servo, recordings, told or (lambda share, loss: None))


def _friction(servo: Servo, recordings: list[Recording], told: Told) -> tuple[Servo, list[str]]:
    from .friction.friction_network import ITERATIONS
    from .friction.servo_friction import learned_friction, with_friction, with_motor_friction

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
    if learned.share is not None:
        said.append(f'friction takes {100.0 * learned.share.share:.3g} % '
                    f'(± {100.0 * learned.share.share_std:.2g}) of the load')
    servo = with_friction(servo, learned)
    if servo.mechanism.compliant and all(r.has('torque') for r in recordings):
        servo, sentence = with_motor_friction(servo, recordings)
        said.append(sentence)
    return servo, said


def _backlash(servo: Servo, recordings: list[Recording], told: Told) -> tuple[Servo, list[str]]:
    from .transmission.backlash_map import ITERATIONS, learned_backlash, with_backlash

    learned = learned_backlash(servo, recordings, told=lambda iteration, _, kept: told(
        iteration / ITERATIONS, kept))
    s = learned.scores
    return with_backlash(servo, learned), [
        f'backlash over angle and load: MSE {s.mse:.6f} arcmin2, MAE {s.mae:.5f} arcmin, '
        f'MAPE {s.mape:.3f} %; {learned.orders} low orders kept']


def _transmission_error(servo: Servo, recordings: list[Recording], told: Told
                        ) -> tuple[Servo, list[str]]:
    from .transmission.transmission_harmonics import learned_error, with_error

    learned = learned_error(servo, recordings)
    told(1.0, max(s.mse for s in learned.scores))
    return with_error(servo, learned), learned.sentences()


def _current_loop(servo: Servo, recordings: list[Recording], told: Told
                  ) -> tuple[Servo, list[str]]:
    from .current_loop import learned_current_loop, with_current_loop

    found = learned_current_loop(servo, recordings)
    told(1.0, found.rms**2)
    return with_current_loop(servo, found), [
        f'current that is left: {1e3 * found.rms:.3g} mA, {1e3 * found.rms_without:.3g} mA '
        'without the loop',
        *(f'{path}: {value:.5g} ± {found.std[path]:.2g}' for path, value in found.values.items())]


def _presliding(servo: Servo, recordings: list[Recording], told: Told) -> tuple[Servo, list[str]]:
    from .friction.presliding import EVALUATIONS, learned_presliding, with_presliding

    trials = 0

    def heard(mean: float) -> None:
        nonlocal trials
        trials += 1
        told(min(1.0, trials / EVALUATIONS), 1.0 - mean)

    found = learned_presliding(servo, recordings, told=heard)
    return with_presliding(servo, found), [
        f'presliding friction: {found.level:.4g} N m, breakaway after {found.breakaway:.3g} rad; '
        f'mean R of free runs {found.before:.4f} -> {found.after:.4f}']


def _residual(servo: Servo, recordings: list[Recording], told: Told) -> tuple[Servo, list[str]]:
    from .friction.friction_network import ITERATIONS
    from .networks.residual_network import learned_residual, with_residual

    learned = learned_residual(servo, recordings, told=lambda iteration, _, kept: told(
        iteration / ITERATIONS, kept))
    s = learned.scores
    return with_residual(servo, learned), [
        f'residual torque over current and speed: MSE {s.mse:.4g} N2 m2, MAE {s.mae:.4g} N m, '
        f'R2 {s.r2:.4f} on seconds that were kept back']


def _deviation(servo: Servo, recordings: list[Recording], told: Told) -> tuple[Servo, list[str]]:
    from .networks.deviation_network import learned_deviation, with_deviation

    learned = learned_deviation(servo, recordings, told=told)
    s, unit = learned.scores, 'm' if servo.straight('load_position') else 'rad'
    return with_deviation(servo, learned), [
        f'deviation of the load over wanted and analytical position: RMSE {s.rmse:.4g} {unit}, '
        f'R2 {s.r2:.4f} on seconds that were kept back']


_LEARNERS = {'friction': _friction, 'backlash': _backlash,
             'transmission_error': _transmission_error, 'current_loop': _current_loop,
             'presliding': _presliding, 'residual': _residual, 'deviation': _deviation}
