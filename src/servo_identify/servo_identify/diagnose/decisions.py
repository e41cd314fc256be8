"""
Every number that decides what a diagnosis says. What else stands in the code is numerics.

Each is a level that a statistician or a user would recognise; none belongs to one machine or case.
"""

PRACTICAL = 0.005
"""Share of an equation's own signal below which a residual matters to nobody."""

CALIBRATED = 1.2
"""Mean square of residuals, in squares of noise and margin, that a fault-free rig may show."""

FORM = 0.1
"""How far the best model of a missing effect may be off, as a share of what the effect does."""

FALSE_ALARM = 0.01
"""Chance that a rig without any fault is given one, over all hypotheses that are tried."""

OPEN = 2.0
"""Noise floors (with the practical margin) above which an equation is certainly off."""

ALTERNATIVE = 0.05
"""
Confidence below which another explanation is not listed.

It is also the chance that a gap that is certainly there gets a first name without any ground.
"""

WORTH = 0.1
"""Share of what others leave of an equation's gap that an effect must close to be worth naming."""

SOLVED = 0.8
"""Share of the gap above the noise floor that must be gone to call a gap explained."""

SAMPLING = 0.7
"""Sample periods by which a channel may be read early or late without being at fault."""

EVEN = 0.5
"""Confidence, and share of the splits, from which a mechanism is named without reserve."""

MENTION = 1.0
"""Nats below which evidence is not worth more than a bare mention (Kass, Raftery: JASA 1995)."""
