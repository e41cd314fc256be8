"""At which instants the channels of a recording would have to be read for the twin to match."""

from __future__ import annotations

from ..decisions import EVEN
from ..selection.explain import Explained


def late_command(found: Explained) -> str:
    """
    Return a sentence where the command acts more than half a sample period after its row, or ''.

    Loggers write rows in many ways, so that this may be one of them and is no fault by itself. A
    command that truly comes late looks the same, and the twin has to be told of it.
    """
    fit, labels = found.explanation.smallest, found.nuisance.labels
    values = {labels[column - 1]: value for column, value in zip(
        fit.columns[1:], fit.values[1:], strict=True) if column <= len(labels)}
    late = -(values.get('late:drive', 0.0) + values.get('late:current', 0.0))
    if 'late:drive' not in values or late <= EVEN:
        return ''
    period = min(one.measured.period for one in found.samples.errors)
    return (f'the recordings fit where the command acts {late:.1f} sample periods '
            f'({1e3 * late * period:.3g} ms) after its row. A logger that writes the command '
            'before it acts does that; otherwise the drive lacks a delay of that size '
            '(command_delay)')
