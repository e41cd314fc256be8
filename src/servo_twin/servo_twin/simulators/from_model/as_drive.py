"""What makes torque of the command at a simulator's joint, as the drive of a servo."""

from __future__ import annotations

from math import cos, sin

from ...physics.drives import CurrentDrive, VoltageDrive
from ...physics.servo_parts import MotorDrive
from ..joint import Joint, ModelError
from .required_values import Given
from .sourced_values import FoundValues


def drive_of(joint: Joint, given: Given, ratio: float, found: FoundValues
             ) -> type[MotorDrive]:
    """Take what makes torque of the command; return the kind of drive. Raises ModelError."""
    if joint.winding is not None:
        _winding(joint, found)
        return VoltageDrive
    if joint.back_emf > 0.0:
        _back_emf(joint, given, ratio, found)
        return VoltageDrive
    if given.resistance is not None:
        raise ModelError(f'--resistance: the actuator of joint {joint.name!r} sets a torque; a '
                         f'winding has no part in it')
    constant = given.torque_constant
    if constant is None:
        found.put('drive.torque_constant', 1.0,
                  'by definition: only its product with the gain counts')
        constant = 1.0
    else:
        found.put('drive.torque_constant', constant, f'given: --torque-constant {constant:g}')
    if joint.gain:
        gain = abs(joint.gain) if joint.controlled else joint.gain
        more = '' if ratio * constant == 1.0 else ', over ratio and torque constant'
        found.put('drive.gain', gain / (ratio * constant),
                  f'{joint.sources.get("gain", "")}{more}', read=True)
    elif given.torque_constant is None:
        found.put('drive.gain', 1.0, 'by definition: the command is the torque of the motor')
    else:
        found.put('drive.gain', 1.0, 'by definition: the command is the current')
    return CurrentDrive


def _winding(joint: Joint, found: FoundValues) -> None:
    motor, by = joint.winding, 'dcmotor of the model'
    found.put('drive.gain', 1.0, 'by definition: the command is the voltage')
    for name, value in (('resistance', motor.resistance), ('inductance', motor.inductance),
                        ('back_emf', motor.constant), ('torque_constant', motor.constant)):
        found.put(f'drive.{name}', value, by, read=True)
    if motor.cogging:
        found.place('cogging', 'cogging', 'motor', by, order=motor.order,
                    cosine=(motor.cogging * sin(motor.phase),),
                    sine=(motor.cogging * cos(motor.phase),))
    if motor.bristle > 0.0:
        found.place('presliding', 'presliding_friction', 'motor', by, level=motor.coulomb,
                    excess=motor.static - motor.coulomb,
                    breakaway=motor.static / motor.bristle, fade=motor.stribeck,
                    lag=motor.bristle_damping / motor.bristle)


def _back_emf(joint: Joint, given: Given, ratio: float, found: FoundValues) -> None:
    """Take a voltage and a winding: of gain, ohms and constant only two quotients are known."""
    slope, lost = joint.gain / ratio, joint.back_emf / ratio**2
    if not slope > 0.0:
        raise ModelError(f'joint {joint.name!r}: its actuator loses torque with speed and takes '
                         f'no command that pushes it forwards')
    gain, said = 1.0, 'by definition: the command is the voltage at the winding'
    resistance, constant = given.resistance, given.torque_constant
    quotient = f'{joint.sources.get("gain", "")}; only its quotient with the resistance is known'
    if resistance is not None and constant is not None:
        gain, said = slope * resistance / constant, f'{joint.sources.get("gain", "")}'
        found.put('drive.torque_constant', constant, f'given: --torque-constant {constant:g}')
        found.put('drive.resistance', resistance, f'given: --resistance {resistance:g}')
    elif constant is not None:
        resistance = constant / slope
        found.put('drive.torque_constant', constant, f'given: --torque-constant {constant:g}')
        found.put('drive.resistance', resistance, quotient.replace('resistance', 'constant'),
                  read=True)
    else:
        known = 'by definition: only its quotients count' if resistance is None else (
            f'given: --resistance {resistance:g}')
        resistance = 1.0 if resistance is None else resistance
        constant = slope * resistance
        found.put('drive.torque_constant', constant, quotient, read=True)
        found.put('drive.resistance', resistance, known)
    found.put('drive.gain', gain, said)
    found.put('drive.inductance', 0.0, 'the model has none')
    found.put('drive.back_emf', lost * resistance / constant, joint.sources.get('back_emf', ''),
              read=True)
