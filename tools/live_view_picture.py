"""
Draws docs/pictures/live_view.png: `python tools/live_view_picture.py [PICTURE]`.

Has the emulated bench record a sine with gravity that its twin does not know, plays it in the live
view, asks for the diagnosis of the last minute, and keeps what a browser shows of the answer.
"""

from __future__ import annotations

from pathlib import Path
import re
import subprocess
import sys
import tempfile
import time

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / 'tests' / 'support'))
from headless_chromium import Browser  # noqa: E402

SIZE = 1400, 1440  # px
PATIENCE = 600.0  # s for the answer
PLAYED = 30.0  # s


def main() -> int:
    """Record, play, diagnose, draw."""
    picture = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / 'docs/pictures/live_view.png')
    with tempfile.TemporaryDirectory(prefix='servo_picture_') as scratch:
        bag = recorded(Path(scratch))
        words = [sys.executable, '-m', 'servo_twin.cli', 'view', str(bag), '--port', '0']
        view = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
        try:
            address = re.search(r'http://[\d.:]+', view.stdout.readline())[0]
            browser = Browser(Path(scratch) / 'profile')
            browser.open(address, *SIZE)
            time.sleep(PLAYED + 2.0)  # the recording plays in real time
            browser.run('one("diagnose").click()')
            browser.until('one("job").hidden === false', 30.0)
            browser.until('!one("answer").hidden', PATIENCE)
            print(browser.run('one("answer").textContent'))
            browser.picture(picture)
            browser.close()
        finally:
            view.terminate()
            view.wait()
    return 0


def recorded(folder: Path) -> Path:
    """Return a bag of the bench with gravity."""
    table, bag = folder / 'run.csv', folder / 'gravity'
    subprocess.run([
        sys.executable, '-m', 'servo_rig_driver.emulated.make_recording', 'sine', '--rig',
        str(ROOT / 'config/rigs/rv_plain.yaml'), '--set', 'withheld.gravity=4', '--setting',
        'amplitude=0.5', '--setting', 'frequency=0.25', '--mode', 'velocity', '--duration',
        f'{PLAYED:g}', '-o', str(table)], check=True)
    subprocess.run([sys.executable, '-m', 'servo_identify.cli', 'import', str(table), '--servo',
                    'rv_plain', '-o', str(bag), '--quiet'], check=True)
    return bag


if __name__ == '__main__':
    sys.exit(main())
