"""Why a device that is sampled has to be started again."""

from __future__ import annotations

from .paced_requests import PacedRequests
from .rig_health import RigHealth
from .rig_watch import RigWatch
from .sampler import Sampler


def must_wake(watch: RigWatch, sampler: Sampler, requests: PacedRequests, health: RigHealth,
              now: int) -> bool:
    """Tell whether the device has to be started again, and have the health say why."""
    if watch.restarted:
        health.event('nodes.restart', f'{watch.restarted} has restarted', now)
        return True
    if watch.silent(now):  # which it has named
        return True
    if sampler.answered_twice(now):
        health.event('nodes.twice', 'requests are answered twice: a second node of one id has '
                     'come, or the drive sends unasked; it is started again', now)
        watch.doubtful = True
        return True
    if requests.stuck:
        watch.lost = watch.lost or sampler.device.loss(now)
        health.event('samples.stuck', f'{sampler.waiting} requests are not answered in full; the '
                     'device is started again', now)
    return requests.stuck
