"""Objects of MATLAB, which it alone can read: what to type there so that their numbers are."""

from __future__ import annotations

from pathlib import Path

_TOLD = {
    'timeseries': "{name} = struct('time', {name}.Time, 'data', squeeze({name}.Data)); "
                  "save('{stem}_plain.mat', '{variable}', '-v7')",
    'timetable': "writetimetable({name}, '{stem}.csv')",
    'table': "writetable({name}, '{stem}.csv')",
    'Simulink.SimulationData.Dataset':
        'for k = 1:{name}.numElements, s = {name}{{k}}; '
        "p.(matlab.lang.makeValidName(s.Name)) = struct('time', s.Values.Time, 'data', "
        "squeeze(s.Values.Data)); end, save('{stem}_plain.mat', '-struct', 'p', '-v7')"}
_OTHERS = ("{name}_t = ...; {name}_u = ...; save('{stem}_plain.mat', '{name}_t', '{name}_u', "
           "'-v7'), with its numbers in place of the dots")


def what_to_type(path: Path, name: str, kind: str) -> str:
    """Return what to type in MATLAB for an object of a class that is in a file."""
    text = _TOLD.get(kind, _OTHERS).format(name=name, variable=name.partition('.')[0],
                                           stem=path.stem)
    return (f'{path}: {name!r} is an object of MATLAB ({kind}), which MATLAB alone reads. Type '
            f"there: load('{path.name}'); {text}")
