"""What of an FMU cannot be used, and the reason that is given."""

from pathlib import Path
import struct
import zipfile

from fmu_maker import made, mapped, servo_of
import pytest

from servo_twin.lockstep.twin import Twin
from servo_twin.physics.servo import ServoError

PERIOD = 1e-3


def _zip(path, **files):
    with zipfile.ZipFile(path, 'w') as archive:
        for name, content in files.items():
            archive.writestr(name.replace('__', '.'), content)
    return path


REFUSED = {
    'there is none': (lambda d: mapped(d / 'none.fmu'), 'none.fmu: cannot be read: No such file'),
    'text': (lambda d: mapped(Path(__file__)), 'it is not an FMU \\(not a zip archive\\)'),
    'a zip': (lambda d: mapped(_zip(d / 'a.zip', readme__txt='x')),
              'it holds no modelDescription.xml'),
    'bad xml': (lambda d: mapped(_zip(d / 'b.zip', modelDescription__xml='<x')),
                'modelDescription.xml cannot be read'),
    'exchange': (lambda d: mapped(made(d, 2, kind='ModelExchange')), 'for model exchange only'),
    'elsewhere': (lambda d: mapped(made(d, 3, place='riscv-plan9')),
                  "no binary for this machine \\(.*\\); it has \\['riscv-plan9'\\]"),
    'unknown': (lambda d: mapped(made(d), '{motor_torque: tau_n}'),
                "inputs.motor_torque: there is no real scalar variable 'tau_n'; near it are "
                "\\['tau_m'"),
    'output': (lambda d: mapped(made(d), '{motor_torque: phi_m}'),
               'phi_m is of causality output, it must be input'),
    'degrees': (lambda d: mapped(made(d, 3, units={'phi_l': 'deg'})),
                'phi_l is in deg, not in rad; map it as {variable: phi_l, factor: 0.0174532925}'),
    'key': (lambda d: mapped(made(d), '{torque: tau_m}'),
            "mechanism.inputs: there is no 'torque'; there are \\['motor_torque', 'external"),
    'nothing in': (lambda d: mapped(made(d), '{}'), 'mechanism.inputs needs motor_torque'),
    'nothing out': (lambda d: mapped(made(d), outputs='{torque: tau}'),
                    'needs motor_angle or load_angle'),
    'no parameter': (lambda d: mapped(made(d), parameters='{ratio: phi_m}'),
                     'phi_m is no parameter but of causality output'),
    'no file': (lambda d: '  type: fmu', "'file' is missing"),
    'value': (lambda d: mapped(made(d)) + '  slope: 3.0', "mechanism has no parameter 'slope'"),
    'load': (lambda d: mapped(made(d), '{motor_torque: tau_m}'),
             'acts on the load, and the FMU is mapped without an input external_torque'),
}


@pytest.mark.parametrize('name', ['../beside.txt', '/etc/beside', r'resources\..\..\beside'])
def test_an_archive_with_a_name_outside_of_its_folder_is_refused_unread(tmp_path, name):
    archive = _zip(tmp_path / 'a.fmu', modelDescription__xml='<x')
    with zipfile.ZipFile(archive, 'a') as more:
        more.writestr(name, 'x')
    with pytest.raises(ServoError, match='lies outside of its folder'):
        servo_of(mapped(archive))
    assert [one.name for one in tmp_path.iterdir()] == ['a.fmu']


def test_an_archive_that_claims_more_than_2_gb_is_refused_unread(tmp_path):
    archive = _zip(tmp_path / 'a.fmu', modelDescription__xml='<x')
    content = archive.read_bytes()
    entry = content.rindex(b'PK\x01\x02')  # of its directory, whose byte 24 begins the size
    archive.write_bytes(content[:entry + 24] + struct.pack('<I', 2_000_000_001)
                        + content[entry + 28:])
    with pytest.raises(ServoError, match='unpacked it has 2000000001 bytes'):
        servo_of(mapped(archive))


@pytest.mark.parametrize('case', REFUSED)
def test_what_cannot_be_used_is_refused_with_a_reason(tmp_path, case):
    section, said = REFUSED[case]
    with pytest.raises(ServoError, match=said):
        servo_of(section(tmp_path))


def test_what_cannot_act_there_is_refused_with_a_reason(tmp_path):
    section = mapped(made(tmp_path))
    with pytest.raises(ServoError, match='effects.play: backlash acts in the transmission, whi'):
        servo_of(section, more='  play: {effect: backlash, at: mesh, width: 0.001}')
    with pytest.raises(ServoError, match='coulomb_friction needs mechanism.rotor_inertia'):
        servo_of(section).with_values({'mechanism.rotor_inertia': 0.0})
    with pytest.raises(ServoError, match='mode observer needs a mechanism whose angles'):
        Twin(servo_of(section), PERIOD, 'observer')
