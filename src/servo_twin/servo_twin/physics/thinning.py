"""How friction follows the temperature of a lubricant."""

from numba import njit

from .elementary_functions import exp

STRAIGHT = 1e-6  # 1/degC: below, a straight line is nearer than the difference of two numbers


@njit(error_model='numpy')
def thinned(warmer, thinning):
    r"""
    Return by how much friction has changed over a rise in temperature, for a slope of one.

    .. math:: \frac{1 - e^{-\beta\,\Delta\vartheta}}{\beta}

    ``warmer`` (degC) is the rise, ``thinning`` (1/degC) the share beta by which a lubricant thins
    with each degree. Without it the change is the rise itself.
    """
    if thinning > STRAIGHT:
        return (1.0 - exp(-thinning * warmer)) / thinning
    return warmer
