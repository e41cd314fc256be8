"""FMU archives, robot models, and whole command lines."""

from __future__ import annotations

from contextlib import redirect_stderr
import io
from pathlib import Path
from random import Random
import zipfile

from target import answered, CONFIG, files, Take, Target

DESCRIPTION = b"""<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="m" guid="{1}">
<CoSimulation modelIdentifier="m" canGetAndSetFMUstate="true"/>
<ModelVariables><ScalarVariable name="a" valueReference="1" causality="input"><Real start="0"/>
</ScalarVariable></ModelVariables><ModelStructure/></fmiModelDescription>"""


def _fmu_seeds(folder: Path) -> list[bytes]:
    made = []
    for names in ({'binaries/linux64/m.so': b'none'}, {}, {'../../slip': b'x'},
                  {'binaries/linux64/m.so': b'none', '/slip': b'x'},
                  {'binaries/linux64/m.so': b'none', '../../../slip': b'x'},
                  {'binaries/linux64/m.so': b'none', 'bomb': bytes(10**7)}):
        memory = io.BytesIO()
        with zipfile.ZipFile(memory, 'w', zipfile.ZIP_DEFLATED) as archive:
            archive.writestr('modelDescription.xml', DESCRIPTION)
            for name, content in names.items():
                archive.writestr(name, content)
        made.append(memory.getvalue())
    return [*made, DESCRIPTION]


def _take_fmu(content: bytes, folder: Path) -> object:
    from servo_twin.fmu.fmu_file import opened
    if content[:5] == b'<?xml':  # a spoilt description in a sound archive
        with zipfile.ZipFile(folder / 'made.fmu', 'w') as archive:
            archive.writestr('modelDescription.xml', content)
            archive.writestr('binaries/linux64/m.so', b'none')
    else:
        (folder / 'made.fmu').write_bytes(content)
    with redirect_stderr(io.StringIO()):
        return opened(folder / 'made.fmu')


def _take_robot(reader: str, suffix: str) -> Take:
    def take(content: bytes, folder: Path) -> object:
        from servo_twin.cli import main
        path = folder / f'robot{suffix}'
        path.write_bytes(content)
        (folder / 'out.yaml').unlink(missing_ok=True)
        return answered(main, [reader, str(path), '--joint', 'elbow', '-o',
                                str(folder / 'out.yaml')])
    return take


COMMANDS = {
    'servo_twin': ('replay', 'linearise', 'from-mjcf', 'from-urdf', 'export', 'parameters'),
    'servo_identify': ('import', 'info', 'check', 'online', 'play', 'sinusoid'),
}


_WORDS = ('spoilt.yaml', 'spoilt.csv', 'rv_bench', 'dc_gearmotor', '--servo', '-o', 'out',
          '--mode', '--set', '--json', '-', '--from', '--joint', '--mapping', '--help', 'nan',
          '-1', '', '--', '--family', '--replicate', '10**9', '--input', '--output', 'a=b', '/',
          '.', 'mechanism.ratio=nan', '\udcff')


def _take_line(content: bytes, folder: Path) -> object:
    from importlib import import_module
    random = Random(content)
    program = random.choice(sorted(COMMANDS))
    (folder / 'spoilt.yaml').write_bytes(content)
    (folder / 'spoilt.csv').write_bytes(content)
    words = [random.choice(COMMANDS[program])]
    choice = [*_WORDS, content[:40].decode('latin1').replace('\x00', '')]
    words += [random.choice(choice) for _ in range(random.randrange(7))]
    words = [str(folder / word) if word.startswith(('spoilt', 'out')) else word for word in words]
    return answered(import_module(f'{program}.cli').main, words)


TARGETS = (
    Target('fmu', False, _fmu_seeds, _take_fmu, ('servo_twin.fmu.fmu_file',)),
    Target('urdf', True, files(CONFIG / 'robots' / 'arm.urdf'), _take_robot('from-urdf', '.urdf'),
           ('servo_twin.simulators.from_model.urdf_model',)),
    Target('mjcf', True, files(CONFIG / 'robots' / 'arm.xml'), _take_robot('from-mjcf', '.xml'),
           ('servo_twin.simulators.from_model.mujoco_joint',)),
    Target('line', True, lambda folder: [b'rv_bench --servo', b'[1, 2]: x'], _take_line,
           ('servo_twin.cli', 'servo_identify.cli')),
)
