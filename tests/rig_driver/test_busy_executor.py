"""A process whose executor always has work to do ends at a signal, and answers meanwhile."""

import signal
import subprocess
import sys

from driver_bench import DriverProcess, Listener, wait_for
import pytest
from test_driver_lifecycle import Hands

pytestmark = pytest.mark.ros

BUSY = """
import os
from time import sleep
import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from servo_rig_driver.ending import Ending
ending = Ending()
rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
node = rclpy.create_node('busy')
executor = EventsExecutor()
executor.add_node(node)
done = Future()
count = iter(range(10**9))
def work():
    sleep(0.02)
    if next(count, None) == 20:
        print('works', flush=True)
        if FINISHES:
            done.set_result(None)
node.create_timer(0.005, work)
ending.then = lambda: os.write(1, b'rests\\n')  # a print that it interrupts may hold stdout
ending.spin(executor, done)
node.destroy_node()
rclpy.try_shutdown()
print('ended', flush=True)
"""


@pytest.mark.parametrize('finishes', [False, True], ids=['by a signal', 'by itself'])
def test_an_executor_that_always_has_work_is_left_at_once(finishes):
    process = subprocess.Popen([sys.executable, '-c', BUSY.replace('FINISHES', str(finishes))],
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        assert process.stdout.readline() == 'works\n'
        if not finishes:
            process.send_signal(signal.SIGTERM)
        assert process.wait(60.0) == 0
        assert process.stdout.read() == ('' if finishes else 'rests\n') + 'ended\n'
    finally:
        process.kill()


SLOW = """
from time import sleep
from servo_rig_driver.driver import driver_node
opened = driver_node.open_bus
def slow(*settings):
    sleep(0.2)
    return opened(*settings)
driver_node.open_bus = slow
raise SystemExit(driver_node.main())
"""


def test_a_driver_that_tries_to_open_its_bus_for_longer_than_it_pauses_can_be_led_and_ended():
    ears = Listener('trying')
    driver = DriverProcess('trying', start=('-c', SLOW), bus__channel='not_there.can',
                           retry_period=0.05)
    try:
        hands = Hands(ears)
        wait_for(lambda: ears.diagnoses, 'it tries')
        assert hands.set('command_timeout', 0.2).successful
        driver.process.send_signal(signal.SIGTERM)
        status, said = driver.wait()
        assert status == 0, said
    finally:
        driver.close()
        ears.close()
