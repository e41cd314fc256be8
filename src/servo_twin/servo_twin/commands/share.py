"""A share as people write one: 10 % or 0.1."""

from __future__ import annotations

import argparse


def share_of(text: str) -> float:
    """Return a share that is written as `10 %` or `0.1`; raises ArgumentTypeError."""
    number, percent = text.strip().removesuffix('%'), text.strip().endswith('%')
    try:
        share = float(number) / (100.0 if percent else 1.0)
    except ValueError:
        raise argparse.ArgumentTypeError(f'{text!r} is no share such as 10 % or 0.1') from None
    if not 0.0 < share < 10.0:
        raise argparse.ArgumentTypeError(f'{text!r} is {100.0 * share:g} %; a share lies above 0 '
                                         'and below 1000 %')
    return share
