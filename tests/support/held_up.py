"""How long a busy machine has kept this process from running: what may take that much longer."""

from threading import Thread
from time import monotonic, sleep

_STEP = 0.01  # s between two looks
_seen: list[tuple[float, float]] = []  # instant, s that a look came late


def _look():
    while True:
        begun = monotonic()
        sleep(_STEP)
        late = monotonic() - begun - _STEP
        if late > _STEP:
            _seen.append((begun, late))


def held_up_since(instant):
    """Return the s that this process could not run since an instant of monotonic()."""
    return sum(late for begun, late in list(_seen) if begun + late > instant)


Thread(target=_look, name='held up', daemon=True).start()
