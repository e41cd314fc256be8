"""Elements that follow over a travel and then slip, for laws that remember the last reversal."""

from numba import njit


@njit(error_model='numpy')
def slipped(s, moved, travel):
    r"""
    Move four elements on and return the sum of their shares, between -4 and 4.

    .. math:: \sum_{i=1}^4 \frac{z_i}{d_i}, \quad d_i = \frac{i}{4} d, \quad
              z_i \leftarrow \min(\max(z_i + \Delta x, -d_i), d_i)

    ``s[:4]`` holds the elements z, ``moved`` is the change of what they follow and ``travel`` d,
    in its unit. Source: Iwan, J. Appl. Mech. 33(4), 1966.
    """
    total = 0.0
    for i in range(4):
        slip = 0.25 * (i + 1) * travel
        s[i] = min(max(s[i] + moved, -slip), slip)
        total += s[i] / slip
    return total
