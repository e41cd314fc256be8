"""A headless Chromium on a pipe: opens a page, moves the mouse, says what went wrong in it."""

import base64
import json
import os
from pathlib import Path
import select
import shutil
import subprocess
import time

NAMES = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable')
PATIENCE = 20.0  # s that one command may take


def found() -> str | None:
    """Return the path of a browser, or nothing where there is none."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Browser:
    """One browser with one page; ``errors`` and ``requests`` are those since the last open."""

    def __init__(self, profile: Path) -> None:
        here, theirs = os.pipe(), os.pipe()
        flags = ('--headless=new', '--no-sandbox', '--disable-gpu', '--no-first-run',
                 '--remote-debugging-pipe', '--hide-scrollbars', '--disable-extensions',
                 '--disable-background-networking', f'--user-data-dir={profile}', 'about:blank')
        self._process = subprocess.Popen(
            ['bash', '-c', f'exec "$@" 3<&{here[0]} 4>&{theirs[1]}', 'bash', found(), *flags],
            pass_fds=(here[0], theirs[1]), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(here[0])
        os.close(theirs[1])
        self._write, self._read, self._buffer, self._number = here[1], theirs[0], b'', 0
        self.errors, self.requests, self._loaded = [], [], False
        self._session = None
        target = self.call('Target.createTarget', url='about:blank')['targetId']
        self._session = self.call('Target.attachToTarget', targetId=target,
                                  flatten=True)['sessionId']
        for domain in ('Page', 'Runtime', 'Log', 'Network'):
            self.call(f'{domain}.enable')

    def call(self, method: str, **parameters) -> dict:
        """Send a command of the DevTools protocol and return its result."""
        self._number += 1
        message = {'id': self._number, 'method': method, 'params': parameters}
        if self._session:
            message['sessionId'] = self._session
        os.write(self._write, json.dumps(message).encode() + b'\0')
        while True:
            answer = self._next(f'an answer to {method}')
            if answer.get('id') == self._number:
                assert 'error' not in answer, f'{method}: {answer["error"]}'
                return answer['result']
            self._note(answer)

    def _next(self, awaited: str) -> dict:
        until = time.monotonic() + PATIENCE
        while b'\0' not in self._buffer:
            left = until - time.monotonic()
            ready, _, _ = select.select([self._read], [], [], max(0.0, left))
            assert ready, f'the browser gave {awaited} not within {PATIENCE} s'
            piece = os.read(self._read, 1 << 20)
            assert piece, f'the browser ended before {awaited}'
            self._buffer += piece
        message, _, self._buffer = self._buffer.partition(b'\0')
        return json.loads(message)

    def _note(self, event: dict) -> None:
        method, said = event.get('method'), event.get('params', {})
        if method == 'Runtime.exceptionThrown':
            details = said['exceptionDetails']
            self.errors.append(details.get('exception', {}).get('description') or details['text'])
        elif method == 'Runtime.consoleAPICalled' and said['type'] in ('error', 'warning'):
            self.errors.append(str(said['args']))
        elif method == 'Log.entryAdded' and said['entry']['level'] in ('error', 'warning'):
            self.errors.append(said['entry']['text'])
        elif method == 'Network.requestWillBeSent':
            self.requests.append(said['request']['url'])
        elif method == 'Page.loadEventFired':
            self._loaded = True

    def before_any_page(self, script: str) -> None:
        """Run a script in each page before the page's own."""
        self.call('Page.addScriptToEvaluateOnNewDocument', source=script)

    def open(self, path: Path | str, width: int = 1400, height: int = 900,
             dark: bool = False) -> None:
        """Open a file or URL in a window of a size (px) and wait until it has drawn itself."""
        self.call('Emulation.setDeviceMetricsOverride', width=width, height=height,
                  deviceScaleFactor=1, mobile=False)
        self.call('Emulation.setEmulatedMedia', features=[
            {'name': 'prefers-color-scheme', 'value': 'dark' if dark else 'light'}])
        self.errors, self.requests, self._loaded = [], [], False
        self.call('Page.navigate', url=path if isinstance(path, str) else path.as_uri())
        while not self._loaded:
            self._note(self._next('the page'))
        self.settle()

    def settle(self) -> None:
        """Wait until two frames are drawn."""
        self.run('new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))')

    def run(self, script: str):
        """Return what an expression in the page evaluates to."""
        answer = self.call('Runtime.evaluate', expression=script, awaitPromise=True,
                           returnByValue=True)
        assert 'exceptionDetails' not in answer, answer['exceptionDetails']
        return answer['result'].get('value')

    def until(self, script: str, seconds: float = 90.0):
        """Wait until an expression in the page is true; return its value."""
        end = time.monotonic() + seconds
        while not (value := self.run(script)):
            assert time.monotonic() < end, f'not within {seconds:g} s: {script}'
            time.sleep(0.05)
        return value

    def mouse(self, kind: str, x: float, y: float, **more) -> None:
        """Send Moved, Pressed or Released of the mouse at a place of the window (px)."""
        self.call('Input.dispatchMouseEvent', type=f'mouse{kind}', x=x, y=y, **more)

    def picture(self, path: Path) -> None:
        """Save the whole page as a PNG."""
        shot = self.call('Page.captureScreenshot', captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(shot['data']))

    def close(self) -> None:
        """End the browser."""
        os.close(self._write)
        os.close(self._read)
        self._process.terminate()
        self._process.wait(PATIENCE)
