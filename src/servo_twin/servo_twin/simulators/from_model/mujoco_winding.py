"""The actuator `dcmotor` of MuJoCo: a motor with winding, cogging and friction of its own."""

from __future__ import annotations

from ..joint import ModelError, Winding
from .mujoco_probe import is_of, Probe


def winding_of(probe: Probe, place: int, name: str) -> Winding | None:
    """
    Return the motor of an actuator, None where it is of another kind.

    The places of the parameters are those of MuJoCo's engine (mj_dcmotorSlots, mjGAIN_DCMOTOR,
    mjBIAS_DCMOTOR). Raises ModelError where its input is not the voltage.
    """
    model = probe.model
    if not is_of(model.actuator_gaintype[place],
                 getattr(probe.mujoco.mjtGain, 'mjGAIN_DCMOTOR', -1)):
        return None
    if not is_of(model.actuator_ctrlspec[place], probe.mujoco.mjtCtrlInput.mjINPUT_VOLTAGE):
        raise ModelError(f'actuator {name!r}: the controller of a dcmotor is not read; only '
                         f'input="voltage" is. Give its gains by --kp and --kd')
    gear = float(model.actuator_gear[place][0])
    if not gear > 0.0:
        raise ModelError(f'actuator {name!r}: gear {gear:g}; the motor of a servo turns the way '
                         f'of its load: make it positive and turn the sign of the voltage round')
    gain, bias = model.actuator_gainprm[place], model.actuator_biasprm[place]
    dynamics = model.actuator_dynprm[place]
    resistance, constant = float(gain[0]), float(gain[1])
    return Winding(
        resistance, float(dynamics[0]) * resistance, constant,
        gear, cogging=float(bias[0]), order=float(bias[1]), phase=float(bias[2]),
        bristle=float(dynamics[5]), bristle_damping=float(dynamics[6]), coulomb=float(bias[3]),
        static=float(bias[4]), stribeck=float(bias[5]))


def is_warm(probe: Probe, place: int) -> bool:
    """Whether a motor's resistance follows its temperature."""
    return bool(probe.model.actuator_dynprm[place][2] > 0.0)
