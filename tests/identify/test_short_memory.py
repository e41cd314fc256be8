"""An identify node that gets no more memory: it ..."""

from pathlib import Path
import resource
from time import sleep
from types import SimpleNamespace

from identify_graph import emulated, Graph
import pytest
from rclpy._rclpy_pybind11 import RCLError

from servo_identify.nodes import short_memory
from servo_identify.nodes.short_memory import is_shortage, Shortage


@pytest.fixture
def shortage(monkeypatch):
    for module, name in ((short_memory.sys, 'excepthook'), (short_memory.sys, 'unraisablehook'),
                         (short_memory.threading, 'excepthook')):
        monkeypatch.setattr(module, name, getattr(module, name))
    return Shortage()


def short(*_):
    raise MemoryError('no room for an array')


def test_it_goes_on_after_a_callback_without_memory_and_says_it_once(shortage, capfd):
    again = []
    for _ in range(3):
        assert shortage.guarded(short, lambda: again.append(1))('message') is None
    assert shortage.guarded(short)('request', 'response') == 'response'
    assert (shortage.times, shortage.now, again) == (4, True, [1, 1, 1])
    assert capfd.readouterr().err == f'identify_node: {short_memory.SAID}\n'
    assert shortage.guarded(lambda one: one + 1)(1) == 2
    with pytest.raises(KeyError):
        shortage.guarded(lambda: {}['other errors are errors'])()


def test_it_knows_a_shortage_by_the_words_of_ros_and_of_threads():
    assert is_shortage(RCLError('failed to take: bad alloc'))
    assert is_shortage(RuntimeError("can't start new thread"))
    assert not is_shortage(RuntimeError('a wait set is empty'))
    assert not is_shortage(ValueError('memory'))


def test_it_spins_on_where_ros_has_no_memory_and_gives_up_after_long(shortage, monkeypatch, capfd):
    turns = []

    def spin(*_):
        turns.append(1)
        if len(turns) < 4:
            short()

    monkeypatch.setattr(short_memory, 'WAIT', 0.001)
    assert shortage.spin(SimpleNamespace(spin=spin), None) == 0 and len(turns) == 4
    monkeypatch.setattr(short_memory, 'PATIENCE', 0.01)
    assert shortage.spin(SimpleNamespace(spin=short), None) == 1
    assert 'ended: ROS had no memory for a minute' in capfd.readouterr().err


def test_a_thread_without_memory_leaves_no_stack_trace(shortage, capfd):
    thread = short_memory.threading.Thread(target=short)
    thread.start()
    thread.join()
    assert 'Traceback' not in capfd.readouterr().err and shortage.times == 1


@pytest.mark.ros
@pytest.mark.long
@pytest.mark.timeout(400)
def test_its_process_lives_through_a_memory_that_is_cut_ten_times(tmp_path, capfd):
    graph = Graph('buffer:=20.0', 'watch.learn:=12.0')
    try:
        graph.feed(emulated(tmp_path, 'long', 120), 1.0)
        node = graph.nodes[1]
        graph.wait(lambda: int(graph.fact('identify: models', 'samples kept') or 0) > 2000)
        for cut in range(10):
            held = int(Path(f'/proc/{node.pid}/statm').read_text().split()[0])
            most = held * resource.getpagesize() + (0, 1 << 16)[cut % 2]
            resource.prlimit(node.pid, resource.RLIMIT_AS, (most, resource.RLIM_INFINITY))
            sleep(2.0)
            resource.prlimit(node.pid, resource.RLIMIT_AS, (resource.RLIM_INFINITY,) * 2)
            sleep(0.5)
            assert node.poll() is None
        graph.wait(lambda: graph.fact('identify: memory', 'times short') is not None)
    finally:
        graph.close()
    assert 'Traceback' not in capfd.readouterr().err
