"""What builds up over a travel after each reversal, for laws that remember it (Dahl)."""

from numba import njit

from .elementary_functions import exp


@njit(error_model='numpy')
def built_up(share, moved, travel):
    r"""
    Return the share of its end value that is there after one more motion, between -1 and 1.

    .. math:: \frac{dz}{dx} = \frac{1 - z\,\mathrm{sgn}(\dot x)}{d}

    ``share`` is z before, ``moved`` the change of x and ``travel`` d, in its unit. By the closed
    form, so exact while x does not turn round within a step. Source: Dahl, Aerospace Corporation
    TOR-0158(3107-18)-1, 1968, with exponent one.
    """
    way = 1.0 if moved > 0.0 else -1.0
    return way + (share - way) * exp(-abs(moved) / travel)
