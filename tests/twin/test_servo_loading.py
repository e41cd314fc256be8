"""The service that exchanges a servo: what it refuses is not done later."""

from types import SimpleNamespace

import pytest

from servo_twin.description import servo_file, shipped
from servo_twin.nodes import servo_loading
from servo_twin.nodes.servo_loading import ServoLoading
from servo_twin.physics.servo import ServoError


@pytest.fixture
def busy_twin(monkeypatch):
    """A loader beside a twin that comes to its tasks only when the test runs them."""
    monkeypatch.setattr(servo_loading, 'WITHIN', 0.05)
    tasks, exchanged = [], []
    loading = ServoLoading.__new__(ServoLoading)
    loading._twin = SimpleNamespace(executor=SimpleNamespace(create_task=tasks.append),
                                    exchange=exchanged.append)
    return loading, tasks, exchanged


def test_a_servo_that_was_refused_for_want_of_time_is_not_loaded_later(busy_twin):
    loading, tasks, exchanged = busy_twin
    servo = servo_file.load(shipped.servo_file('rv_plain'))
    with pytest.raises(ServoError, match='it goes on with the servo that it has'):
        loading._exchange(servo)
    for task in tasks:
        task()
    assert exchanged == []


def test_a_servo_whose_exchange_has_begun_is_answered_when_it_is_done(busy_twin):
    loading, tasks, exchanged = busy_twin
    servo = servo_file.load(shipped.servo_file('rv_plain'))
    loading._twin.executor.create_task = lambda task: task()
    assert loading._exchange(servo) is None
    assert exchanged == [servo]


def test_what_is_far_too_long_for_a_servo_is_refused_without_reading_it_all(tmp_path):
    with (tmp_path / 'bag.mcap').open('wb') as file:
        file.truncate(1 << 43)  # of zeros, which take no room on the disk
    with pytest.raises(ServoError, match='bag.mcap: it is too long; a servo file has at most'):
        servo_file.load(tmp_path / 'bag.mcap')


def test_the_home_of_a_user_that_there_is_not_is_named():
    with pytest.raises(ServoError, match='^~nobody_at_all/x.yaml: there is no such user'):
        shipped.servo_file('~nobody_at_all/x.yaml')
