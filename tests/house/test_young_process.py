"""A process that is told to end while it still imports leaves nothing behind, nor in its log."""

import os
import signal
import subprocess
import sys

import pytest


@pytest.mark.parametrize('package', ['servo_rig_driver', 'servo_twin.nodes'])
def test_what_we_started_ends_by_the_first_signal_without_a_stack_trace(package):
    with subprocess.Popen(
            [sys.executable, '-c',
             f'import {package}, time; print("here", flush=True); time.sleep(30.0)'],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env=os.environ | {'SERVO_PARENT': str(os.getpid())}) as young:
        assert young.stdout.readline() == 'here\n'
        young.send_signal(signal.SIGINT)
        assert young.wait(30.0) == -signal.SIGINT
        assert young.stderr.read() == ''


@pytest.mark.parametrize('package', ['servo_rig_driver', 'servo_twin.nodes'])
def test_a_program_that_only_imports_us_keeps_its_interrupt(package):
    told = subprocess.run(
        [sys.executable, '-c', f'import {package}, signal\n'
         'assert signal.getsignal(signal.SIGINT) is signal.default_int_handler'],
        capture_output=True, text=True, timeout=60.0)
    assert told.returncode == 0, told.stderr
