"""Units of what moves straight."""


def straightened(unit: str) -> str:
    """Return the unit of what moves straight for that of what turns: kg, N and m."""
    return unit.replace('kg m2', 'kg').replace('N m', 'N').replace('rad', 'm')
