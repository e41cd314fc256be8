"""What the driver says about the rig: what is wrong, since when, and who was heard last."""

from servo_rig_driver.driver.rig_health import Heartbeats, Level, RigHealth


def test_it_keeps_since_when_while_the_words_change():
    health = RigHealth()
    health.trouble('bus', 'no bus', 10)
    health.trouble('bus', 'still no bus', 20)
    (trouble,) = health.troubles
    assert (trouble.since, trouble.text, trouble.until) == (10, 'still no bus', None)


def test_it_remembers_what_passed_and_when():
    health = RigHealth()
    health.trouble('bus', 'no bus', 10)
    health.over('bus', 30)
    assert health.troubles == ()
    assert health.level is Level.OK
    assert [(t.key, t.since, t.until) for t in health.past] == [('bus', 10, 30)]


def test_it_puts_the_worst_first_and_then_the_oldest():
    health = RigHealth()
    health.trouble('late', 'late', 1, Level.WARN)
    health.trouble('fault', 'fault', 3)
    health.trouble('bus', 'bus', 2)
    assert [t.key for t in health.troubles] == ['bus', 'fault', 'late']
    assert health.level is Level.ERROR


def test_it_clears_a_family_of_troubles_at_once():
    health = RigHealth()
    health.trouble('heartbeat 1', 'lost', 1)
    health.trouble('heartbeat 2', 'lost', 1)
    health.trouble('bus', 'lost', 1)
    health.over_all('heartbeat', 5)
    assert [t.key for t in health.troubles] == ['bus']


def test_it_finds_the_node_that_fell_silent():
    beats = Heartbeats({1: 'drive', 2: 'encoder'}, timeout=0.3)
    beats.expect(0)
    beats.beat(1, Heartbeats.OPERATIONAL, 250_000_000)
    assert beats.late(299_000_000) == []
    assert beats.late(301_000_000) == [2]


def test_it_waits_for_every_node_to_tell_its_state():
    beats = Heartbeats({1: 'drive', 2: 'encoder'}, timeout=0.3)
    beats.expect(0)
    beats.beat(1, Heartbeats.OPERATIONAL, 1)
    assert not beats.all_in(Heartbeats.OPERATIONAL)
    beats.beat(2, 0x80 | Heartbeats.OPERATIONAL, 1)
    assert beats.all_in(Heartbeats.OPERATIONAL)


def test_it_tells_an_event_for_a_while_and_counts_it():
    health = RigHealth()
    health.event('command.refused', 'mode 9', 0, lasts=1.0)
    health.event('command.refused', 'mode 8', 500_000_000, lasts=1.0)
    health.fade(1_400_000_000)
    assert [(t.text, t.since) for t in health.troubles] == [('mode 8', 0)]
    health.fade(1_500_000_000)
    assert health.troubles == ()
    assert health.counted('command.refused') == 2
