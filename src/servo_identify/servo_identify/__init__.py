"""
Identification of the servo twin from recordings and diagnosis of its gap.

    import servo_identify as si

    servo = si.load_servo('my.yaml')
    data = si.read('run*.mcap', servo)
    si.check(data, servo)
    fit = si.fit(data, servo)
    answer = si.diagnose(data, servo)
    answer.augmented.save('my_augmented.yaml')

Each name is loaded when it is first asked for, so that commands start fast.
"""

from __future__ import annotations

import sys

from .api.names import FrontDoor

__all__ = [
    'Answer', 'Checked', 'Fitted', 'Recordings', 'ServoFile', '__version__', 'check', 'diagnose',
    'fit', 'load_servo', 'read',
]

sys.modules[__name__].__class__ = FrontDoor
