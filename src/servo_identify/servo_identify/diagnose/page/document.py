"""What the page of a diagnosis is made of: the report, series, equations and the patch."""

from __future__ import annotations

from datetime import datetime, UTC
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from servo_twin.balances.equation_terms import EQUATIONS, UNITS
from servo_twin.recording.recording import Recording

from ..answer.evidence import Evidence, Finding
from ..answer.left_over import residuals
from ..answer.shown_units import channel_unit
from ..diagnosis import Diagnosis
from ..handover.simulated_gap import simulated

MOST = 4000  # samples of a series
SHOWN = 6  # recordings of a page beside those of the report


def document_of(diagnosis: Diagnosis, patch: str = '', command: str = '') -> dict[str, Any]:
    """Return the document of a diagnosis, plain JSON: see diagnose/page."""
    evidence = diagnosis.evidence
    report = diagnosis.report.as_dict()
    for entry, one in zip(report['which'], evidence.named, strict=True):
        entry['points'] = _points(evidence, one)
    joint = evidence.handover.joint
    correlations = {} if joint is None else {
        'names': list(joint.names), 'matrix': _rounded(joint.correlation)}
    split = evidence.split
    recordings = [*split.screen, *split.accept, *split.report]
    return {
        'report': report, 'series': _series(diagnosis), 'equations': _equations(evidence),
        'correlations': correlations, 'patch': patch,
        'facts': {'command': command, 'version': _version(),
                  'date': datetime.now(UTC).strftime('%Y-%m-%d %H:%M UTC'),
                  'inputs': {one.name: one.digest for one in recordings if one.digest}}}


def _version() -> str:
    try:
        return version('servo_identify')
    except PackageNotFoundError:
        return ''


def _series(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    evidence, several = diagnosis.evidence, []
    split, reported = evidence.split, evidence.reported
    given, handed = reported['given'].outputs, evidence.handed.outputs
    for k, one in enumerate(split.report):
        several.append(_serie(evidence, one, 'report', given[k], handed[k]))
    others = [(purpose, one) for purpose in ('accept', 'screen')
              for one in getattr(split, purpose)
              if all(one is not r for r in split.report)][:SHOWN]
    if others:
        recordings = [one for _, one in others]
        first = simulated(evidence.servo, recordings).outputs
        second = simulated(diagnosis.augmented, recordings).outputs if (
            _changed(evidence)) else first
        several += [_serie(evidence, one, purpose, a, b) for (purpose, one), a, b in zip(
            others, first, second, strict=True)]
    return several


def _serie(evidence: Evidence, recording: Recording, purpose: str, given: dict[str, Any],
           handed: dict[str, Any]) -> dict[str, Any]:
    step = max(1, -(-len(recording) // MOST))
    channels = {}
    for name, twin in given.items():
        if not (recording.has(name) and np.isfinite(twin).any()):
            continue
        one = {'unit': channel_unit(evidence.servo, name),
               'noise': float(evidence.servo.noise(name)), 'rig': _listed(recording[name], step),
               'as_given': _listed(twin, step)}
        if _changed(evidence):
            one['augmented'] = _listed(handed[name], step)
        channels[name] = one
    return {'recording': recording.name, 'family': recording.family or '', 'purpose': purpose,
            't': _listed(np.arange(len(recording)) * recording.period, step),
            'channels': channels}


def _changed(evidence: Evidence) -> bool:
    """Tell whether the servo file that is handed over is another than that given."""
    return bool(evidence.handover.added) and not evidence.worse


def _listed(x: np.ndarray, step: int) -> list[Any]:
    return [None if v != v else v for v in np.asarray(x, dtype=float)[::step].tolist()]


def _equations(evidence: Evidence) -> list[dict[str, Any]]:
    """Return the residuals of the equations before and after, in their units."""
    samples, found = evidence.found.samples, evidence.found
    left = {name: residuals(evidence, one) for name, one in (
        ('before', found.search.nothing), ('after', found.explanation.smallest))}
    several = []
    for number, errors in enumerate(samples.errors):
        for name in EQUATIONS:
            if name not in errors.equations:
                continue
            part = samples.part(number, name)
            kept = samples.kept(number, name)
            t = errors.times(name)[kept]
            step = max(1, -(-len(t) // MOST))
            if len(t):
                several.append({'recording': errors.measured.recording.name, 'equation': name,
                                'unit': evidence.servo.reads(UNITS[name], name),
                                't': _listed(t, step),
                                'before': _listed(left['before'][part], step),
                                'after': _listed(left['after'][part], step)})
    return several


def _points(evidence: Evidence, one: Finding) -> dict[str, Any]:
    """Return measured points under a curve: the curve's value plus what is left, binned by it."""
    curve = one.part.curve
    return {} if curve is None else {'x': curve.x.tolist(), 'y': curve.y.tolist()}


def _rounded(matrix: np.ndarray) -> list[list[Any]]:
    return [[None if v != v else round(float(v), 4) for v in row] for row in matrix]
