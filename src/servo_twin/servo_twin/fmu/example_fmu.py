"""
An FMU of two inertias on a spring, made from C: for tests, and to try the mechanism `fmu` with.

It is the mechanism `two_inertia` in FMI 2 or 3, one step of semi-implicit Euler a call, compiled
with the C compiler of the machine from two_inertia.c and FMPy's headers.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
import subprocess
import tempfile
import zipfile

import fmpy

from .fmu_file import FmuError

COMPILER = 'cc'
SOURCE = Path(__file__).parent / 'two_inertia.c'
TOKEN, TOOL = '{servo-twin-example}', 'servo_twin.fmu.example_fmu'
INPUTS, OUTPUTS = ('tau_m', 'tau_ext'), ('phi_m', 'w_m', 'phi_l', 'w_l', 'tau')
PARAMETERS = {'J_m': 1e-3, 'J_l': 0.5, 'ratio': 20.0, 'c': 4e3, 'd': 2.0, 'phi_m0': 0.0,
              'w_m0': 0.0, 'phi_l0': 0.0, 'w_l0': 0.0, 'fail_at': 1e9}
UNITS = {'tau_m': 'N.m', 'tau_ext': 'N.m', 'tau': 'N.m', 'phi_m': 'rad', 'phi_l': 'rad',
         'J_m': 'kg.m2', 'J_l': 'kg.m2'}
TUNABLE = ('c', 'fail_at')


@cache
def compiled(version: int, rigid: bool) -> bytes:
    """Return the shared library; raises FmuError without a C compiler, or where it fails."""
    headers = Path(fmpy.__file__).parent / 'c-code'
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / 'library'
        try:
            subprocess.run([COMPILER, '-O1', '-shared', '-fPIC', f'-I{headers}',
                            f'-DFMI_VERSION={version}', *(['-DRIGID'] if rigid else []),
                            str(SOURCE), '-o', str(library)], check=True, capture_output=True,
                           text=True)
        except FileNotFoundError:
            raise FmuError(f'there is no C compiler {COMPILER!r} to make the FMU of {SOURCE.name} '
                           'with; on Debian or Ubuntu: apt install gcc') from None
        except subprocess.CalledProcessError as failed:
            raise FmuError(f'{SOURCE.name}: {COMPILER} made no library of it: '
                           f'{failed.stderr.strip()[-500:]}') from None
        return library.read_bytes()


def made(folder: Path, version: int = 2, rigid: bool = False, returns: bool = True,
         kind: str = 'CoSimulation', place: str | None = None, units: dict | None = None) -> Path:
    """
    Return a new FMU in ``folder``.

    ``version`` of FMI, 2 or 3; ``rigid``: one inertia, without the spring; ``returns``: it says
    that its state can be got and set. ``kind``, ``place`` of the binary and ``units`` of variables
    are what the description says, which need not be true. Raises FmuError.
    """
    library = compiled(version, rigid)
    place = place or (fmpy.platform if version == 2 else fmpy.platform_tuple)
    fmu = folder / f'screw{version}{"r" if rigid else ""}.fmu'
    with zipfile.ZipFile(fmu, 'w') as archive:
        archive.writestr('modelDescription.xml', description(
            version, returns, kind, {**UNITS, **(units or {})}))
        archive.writestr(f'binaries/{place}/screw{fmpy.sharedLibraryExtension}', library)
    return fmu


def description(version: int, returns: bool, kind: str, units: dict[str, str]) -> str:
    """Return the text of modelDescription.xml."""
    can = 'true' if returns else 'false'
    names = [*INPUTS, *OUTPUTS, *PARAMETERS]
    base = ('<Unit name="N.m"><BaseUnit kg="1" m="2" s="-2"/></Unit>'
            '<Unit name="rad"><BaseUnit rad="1"/></Unit>'
            '<Unit name="deg"><BaseUnit rad="1" factor="0.017453292519943295"/></Unit>'
            '<Unit name="kg.m2"><BaseUnit kg="1" m="2"/></Unit>')
    rows = []
    for reference, name in enumerate(names):
        causality = ('input' if name in INPUTS else 'output' if name in OUTPUTS else 'parameter')
        start = PARAMETERS.get(name, 0.0)
        unit = f' unit="{units[name]}"' if name in units else ''
        start = '' if causality == 'output' else f' start="{start!r}"'
        more = ('variability="continuous"' if causality != 'parameter' else
                f'variability="{"tunable" if name in TUNABLE else "fixed"}"')
        if version == 2:
            rows.append(f'<ScalarVariable name="{name}" valueReference="{reference}" '
                        f'causality="{causality}" {more}><Real{unit}{start}/></ScalarVariable>')
        else:
            rows.append(f'<Float64 name="{name}" valueReference="{reference}" '
                        f'causality="{causality}" {more}{unit}{start}/>')
    variables = f'<ModelVariables>{"".join(rows)}</ModelVariables>'
    outputs = range(len(INPUTS), len(INPUTS) + len(OUTPUTS))
    if version == 2:
        structure = ''.join(f'<Unknown index="{i + 1}"/>' for i in outputs)
        return (f'<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="2.0" '
                f'modelName="screw" guid="{TOKEN}" generationTool="{TOOL}">'
                f'<{kind} modelIdentifier="screw" canGetAndSetFMUstate="{can}" '
                f'canHandleVariableCommunicationStepSize="true"/>'
                f'<UnitDefinitions>{base}</UnitDefinitions>{variables}'
                f'<ModelStructure><Outputs>{structure}</Outputs></ModelStructure>'
                f'</fmiModelDescription>')
    structure = ''.join(f'<Output valueReference="{i}"/>' for i in outputs)
    return (f'<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="3.0" '
            f'modelName="screw" instantiationToken="{TOKEN}" generationTool="{TOOL}">'
            f'<{kind} modelIdentifier="screw" canGetAndSetFMUState="{can}" '
            f'canHandleVariableCommunicationStepSize="true"/>'
            f'<UnitDefinitions>{base}</UnitDefinitions>{variables}'
            f'<ModelStructure>{structure}</ModelStructure></fmiModelDescription>')
