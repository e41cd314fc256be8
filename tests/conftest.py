"""What every test may rely on: a ROS domain of its own, and the recordings of real machines."""

import fcntl
import os
from pathlib import Path
import shutil
import tempfile

from hypothesis import settings
import pytest

from servo_rig_driver.ros_start import udp_alone

ROOT = Path(__file__).resolve().parent.parent
LAST_DOMAIN = 101  # above it, DDS ports reach into the range that the kernel hands out
_domain_locks = []

# The first call of a compiled law takes seconds, which is no failure of the law. The examples are
# the same each time, so that a change is judged by what it changed; HYPOTHESIS_PROFILE=search
# looks for new ones.
settings.register_profile('workspace', deadline=None, derandomize=True)
settings.register_profile('search', deadline=None, max_examples=1000)
settings.load_profile(os.environ.get('HYPOTHESIS_PROFILE', 'workspace'))


def _claim_domain() -> int:
    """Return a ROS domain that no other test process of this machine has, kept until it ends."""
    for domain in range(1, LAST_DOMAIN + 1):
        lock = open(Path(tempfile.gettempdir()) / f'servo_twin_domain_{domain}.lock', 'a')
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            lock.close()
            continue
        _domain_locks.append(lock)
        return domain
    raise RuntimeError(f'all ROS domains from 1 to {LAST_DOMAIN} are taken by other tests')


def pytest_configure(config):
    """Give this process, and all that it starts, a ROS domain and a log folder of its own."""
    os.environ['ROS_DOMAIN_ID'] = str(_claim_domain())
    if 'PYTEST_XDIST_WORKER' not in os.environ:  # a worker has it from the one that started it
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
        os.environ.update(udp_alone(os.environ))  # also for the nodes of the tests themselves
    os.environ['ROS_LOG_DIR'] = tempfile.mkdtemp(prefix='servo_twin_ros_log_')


def pytest_unconfigure(config):
    """Remove the log folder of this process."""
    shutil.rmtree(os.environ['ROS_LOG_DIR'], ignore_errors=True)


@pytest.fixture(scope='session')
def shared_data() -> Path:
    """The folder of real recordings beside the workspace; skips where it is absent."""
    folder = Path(os.environ.get('SERVO_TWIN_DATA', ROOT.parent / 'shared' / 'data'))
    if not folder.is_dir():
        pytest.skip(f'no recordings of real machines in {folder}')
    return folder
