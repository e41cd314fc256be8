"""Modules hold one idea, which their name says: none is long without a reason."""

from collections import Counter
from pathlib import Path

SOURCES = Path(__file__).parents[2] / 'src'
MOST = 250  # lines

LONGER = {
    'servo_identify/diagnose/handover/laws.py': 'one curve, as law, harmonics or spline',
    'servo_identify/experiment/performer_node.py': 'one node: a run, its guard and its rest',
    'servo_identify/fit/output_error.py': 'one fit from start to standard deviations',
    'servo_identify/nodes/jobs_node.py': 'one node: its actions share lock and folder',
    'servo_rig_driver/devices/on_request.py': 'one drive from start to rest, whatever it speaks',
    'servo_rig_driver/driver/driver_node.py': 'one lifecycle node: transitions share the link',
    'servo_rig_driver/emulated/canopen_nodes.py': 'one set of objects that SDO and PDO both reach',
    'servo_rig_driver/emulated/rig_process.py': 'one loop between bus, signals and faults',
    'servo_twin/bag/mcap_reading.py': 'one pass over the records of a file',
    'servo_twin/description/servo_file.py': 'one file format, read and written side by side',
    'servo_twin/lockstep/twin.py': 'one twin: steps, gaps and restarts share its state',
    'servo_twin/physics/kernel.py': 'one text that is compiled, made part by part',
    'servo_twin/physics/servo.py': 'one object that all else is read off',
    'servo_twin/simulators/to_model/as_joint.py': 'one function for each part that is translated',
}
"""Modules past MOST, by their path below a package, and why each is one idea."""


def lines_of(path: Path) -> int:
    return len(path.read_text('utf8').splitlines())


def test_a_module_is_short_or_says_why():
    longer = {str(path.relative_to(package)) for package in SOURCES.iterdir()
              for path in package.rglob('*.py') if lines_of(path) > MOST}
    assert longer - set(LONGER) == set(), f'past {MOST} lines: two ideas make two files'
    assert set(LONGER) - longer == set(), 'these need no reason any more'


APART = 'the rig and the twin each have it, and neither knows the other'
WIRE = 'a protocol: how a drive is led, and how the emulated one answers'
EFFECT = 'an effect, and the hypothesis that it is missing'
COMMAND = 'the command of each package, or of the package that does it'
PART = 'a mechanism, and the part of the results that shows it'
TWICE = dict.fromkeys(('ending', 'free_output', 'given_parameters', 'home_path',
                       'managed_node', 'message_conversion', 'message_definitions',
                       'mixed_topics', 'namesake', 'nearest_name', 'node_help', 'ros_start',
                       'timer_clock'), APART)
TWICE |= dict.fromkeys(('mit_mode', 'moteus', 'odrive'), WIRE)
TWICE |= dict.fromkeys(('eddy_brake', 'hysteresis', 'lost_motion'), EFFECT) | {
    'cli': COMMAND, 'diagnose': COMMAND, 'fmu': PART}
"""Names that several modules have, and what is meant by all of them."""


def test_a_name_of_a_module_has_one_meaning():
    names = Counter(path.stem for package in SOURCES.iterdir()
                    for path in (package / package.name).rglob('*.py'))
    twice = {name for name, count in names.items() if count > 1} - {'__init__'}
    assert twice - set(TWICE) == set(), 'another name tells them apart'
    assert set(TWICE) - twice == set(), 'these stand once'
