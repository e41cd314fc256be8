"""The layouts for Foxglove and PlotJuggler name what a run publishes, to the last field."""

import json
from pathlib import Path
import re
import subprocess
import sys
from xml.etree import ElementTree

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

pytestmark = [pytest.mark.ros, pytest.mark.slow]
LAYOUTS = Path(__file__).resolve().parents[2] / 'config' / 'layouts'


def of_foxglove() -> list[str]:
    """Return the topics and fields of the Foxglove layout, as TOPIC.FIELD or TOPIC."""
    panels = json.loads((LAYOUTS / 'foxglove.json').read_text())['configById'].values()
    keys = ('topicPath', 'topicToRender')
    return [path['value'] for panel in panels for path in panel.get('paths', [])] + [
        panel[key] for panel in panels for key in keys if key in panel]


def of_plotjuggler() -> list[str]:
    """Return those of the PlotJuggler layout, whose fields stand behind a slash."""
    root = ElementTree.parse(LAYOUTS / 'plotjuggler.xml').getroot()
    curves = [re.sub(r'/([^/]+)$', r'.\1', one.get('name')) for one in root.iter('curve')]
    return curves + [one.get('name') for one in root.iter('topic')]


def panels_in(layout) -> list[str]:
    if isinstance(layout, str):
        return [layout]
    return panels_in(layout['first']) + panels_in(layout['second'])


def test_every_panel_has_its_place():
    layout = json.loads((LAYOUTS / 'foxglove.json').read_text())
    assert sorted(panels_in(layout['layout'])) == sorted(layout['configById'])


@pytest.mark.long
def test_what_the_layouts_name_is_in_the_bag_of_a_run(tmp_path):
    folder = tmp_path / 'run'
    done = subprocess.run(
        [sys.executable, '-m', 'servo_twin.cli', 'run', '-o', str(folder), '--duration', '1.5'],
        capture_output=True, text=True, timeout=120)
    assert 'identical to the last bit' in done.stdout, done.stdout + done.stderr
    wanted = of_foxglove() + of_plotjuggler()
    assert len(wanted) > 30
    with AnyReader([folder / 'sine']) as reader:
        said = {}
        for connection, _, raw in reader.messages():
            said.setdefault(connection.topic, []).append(
                reader.deserialize(raw, connection.msgtype))
        known = {connection.topic for connection in reader.connections}
    for one in wanted:
        topic, _, field = one.partition('.')
        assert topic in known, f'{one}: a run publishes {sorted(known)}'
        if field:
            value = getattr(said[topic][-1], field.removesuffix('[0]'))
            assert len(value) if field.endswith('[0]') else isinstance(value, float), one
    plotted = said['/rig/twin/plot/residual']
    stamps = np.array([m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec for m in plotted])
    assert np.median(np.diff(stamps)) == pytest.approx(0.02, rel=0.01)
    full = {name: np.concatenate([getattr(m, name) for m in said['/rig/twin/residual']])
            for name in ('load', 'torque')}
    for name, values in full.items():  # no peak is lost
        shown = np.array([getattr(m, name) for m in plotted])
        assert np.nanmax(np.abs(shown)) == np.nanmax(np.abs(values))
