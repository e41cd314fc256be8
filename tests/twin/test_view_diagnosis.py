"""The diagnosis that the page of the live view asks for: it ..."""

import asyncio
import json
from threading import Event

from servo_twin.view import diagnosis_process as module
from servo_twin.view.diagnosis_process import Diagnosis
from servo_twin.view.traces import Traces
from servo_twin.view.viewed import View


class Browser:
    """A browser that keeps what it was told; ``busy`` is set by the test."""

    busy = 0

    def __init__(self):
        self.told = []

    def say(self, message):
        """Keep the facts about a diagnosis."""
        facts = json.loads(message).get('facts', {}) if isinstance(message, str) else {}
        self.told += [facts['diagnosis']] if 'diagnosis' in facts else []

    def close(self, code, reason):
        """End the connection."""


class StillRig:
    """A rig without samples, whose recording is what a test says."""

    kind = 'rig'

    def __init__(self, take):
        self.traces, self._take = Traces(), take

    def look(self, wanted):
        """Begin or end to take samples."""

    def advance(self):
        """Nothing is due."""

    def facts(self):
        """Return no fact."""
        return {}

    def servo(self):
        """Return no servo."""

    def events(self):
        """Return no event."""
        return []

    def recording(self, seconds):
        """Return or raise what the test says."""
        return self._take()


async def until(told, what):
    """Return the first thing told for which ``what`` holds."""
    async with asyncio.timeout(30.0):
        while True:
            for one in told:
                if what(one):
                    return one
            await asyncio.sleep(0.01)


def raising(problem):
    """Return a function that raises."""
    def take():
        raise problem
    return take


def test_an_error_of_any_kind_reaches_the_page_as_a_sentence(tmp_path):
    async def story(problem):
        view = View(StillRig(raising(problem)), Diagnosis(tmp_path), control=False)
        browser = Browser()
        view.enter(browser)
        await view.ask(browser, {'diagnose': True})
        told = await until(browser.told, lambda one: one['problem'])
        await view.close()
        return told

    for problem in (ValueError('0.2 s of samples are here'), IndexError('list index'),
                    MemoryError('no room')):
        told = asyncio.run(story(problem))
        assert str(problem) in told['problem'] and not told['running']


def test_a_job_that_is_killed_or_fails_says_so(tmp_path, monkeypatch):
    async def story(job):
        (tmp_path / f'{job}.py').write_text(
            'import os, signal\nprint("what is wrong", flush=True)\n' + (
                'os.kill(os.getpid(), signal.SIGKILL)' if job == 'killed' else
                'raise SystemExit(2)'))
        monkeypatch.setattr(module, '_JOB', job)
        monkeypatch.setattr(module, '_written', lambda take, folder: folder)
        said = []
        kept = Diagnosis(tmp_path / 'answers', lambda: said.append(''), said.append)
        kept.begin(lambda: None)
        await until(said, bool)
        return kept.facts['problem'], said

    monkeypatch.setenv('PYTHONPATH', str(tmp_path), prepend=':')
    problem, said = asyncio.run(story('failing'))
    assert problem == 'what is wrong' and said == ['', 'what is wrong']
    problem, said = asyncio.run(story('killed'))
    assert 'SIGKILL' in problem and said[-1] == problem


def test_the_page_is_told_when_the_view_ends_before_the_answer(tmp_path):
    async def story():
        free = Event()
        view = View(StillRig(lambda: free.wait(30.0)), Diagnosis(tmp_path), control=False)
        browser = Browser()
        view.enter(browser)
        await view.ask(browser, {'diagnose': True})
        await until(browser.told, lambda one: one['running'])
        free.set()
        await view.close()
        return browser.told[-1]

    told = asyncio.run(story())
    assert not told['running'] and 'the view ended before the diagnosis did' in told['problem']


def test_a_browser_that_is_slow_gets_the_answer_as_soon_as_it_can(tmp_path):
    async def story():
        view = View(StillRig(raising(ValueError('nothing moves'))), Diagnosis(tmp_path),
                    control=False)
        slow, quick = Browser(), Browser()
        for browser in (slow, quick):
            view.enter(browser)
        slow.busy = 1
        await view.ask(quick, {'diagnose': True})
        await until(quick.told, lambda one: one['problem'])
        assert slow.told == []
        view._tick.stop()  # the next of many, not one of those at which facts are due
        while view._count % 8 != 1:
            view._advance()
        slow.busy = 0
        view._advance()
        await view.close()
        return slow.told[0]

    assert asyncio.run(story())['problem'] == 'nothing moves'
