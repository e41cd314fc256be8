"""A case as a folder: servo.yaml, a table for each recording, recordings.yaml and truth.json."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import yaml

from .fault_case import Case


def write_case(case: Case, folder: Path) -> Path:
    """Write a case below a folder and return where it is; files that are there are replaced."""
    place = Path(folder) / case.name
    place.mkdir(parents=True, exist_ok=True)
    (place / 'servo.yaml').write_text(case.servo)
    listed = {}
    for one in case.recordings:
        table = np.column_stack(list(one.columns.values()))
        with (place / f'{one.name}.csv').open('w') as file:
            file.write(','.join(one.columns) + '\n')
            np.savetxt(file, table, fmt='%.10g', delimiter=',')
        listed[f'{one.name}.csv'] = {'family': one.family, 'replicate': one.replicate}
    (place / 'recordings.yaml').write_text(yaml.safe_dump(listed))
    truth = {'name': case.name, 'kind': case.kind, 'machine': case.machine.name,
             'style': case.style, 'severity': case.severity, 'truth': case.truth,
             'lacks': [one.as_tree() for one in case.lacks], 'shows': case.shows(),
             'sensors': list(case.machine.noise), 'period': case.machine.period,
             'true_values': {name: float(value) for name, value in
                             case.machine.plant._asdict().items()}}
    (place / 'truth.json').write_text(json.dumps(truth, indent=1, default=float) + '\n')
    return place
