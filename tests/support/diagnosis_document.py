"""A believable document of the diagnosis page, made of a small simulation with a fixed seed."""

from copy import deepcopy
from functools import cache

import numpy as np

STATUSES = ('no_gap', 'explained', 'partly_explained', 'unknown')
PERIOD, LASTING = 0.01, 12.0  # s
BARE = {'report': {'verdict': {'status': 'unknown', 'sentence': 'Nothing is known.'}}}
HOSTILE = '</script><script>window.hacked=1</script><img src=x onerror="window.hacked=2">'


def document(status: str = 'partly_explained') -> dict:
    """Return the document of a diagnosis that ended with a status."""
    return deepcopy(_document(status))


@cache
def _document(status: str) -> dict:
    rng = np.random.default_rng(7)
    recordings = [('multisine_1', 'multisine', 'screen'), ('sweep_1', 'sine_sweep', 'screen'),
                  ('load_steps_2', 'load_steps', 'accept'), ('multisine_3', 'multisine', 'report'),
                  ('load_steps_3', 'load_steps', 'report')]
    found = status in ('explained', 'partly_explained')
    series = [_series(rng, k, *one, found) for k, one in enumerate(recordings)]
    return {
        'report': _report(rng, status, found, recordings),
        'series': series, 'equations': _equations(rng, series, found),
        'correlations': _correlations(rng), 'patch': PATCH if found else '',
        'facts': {
            'command': 'servo-identify diagnose recordings/*.mcap --servo rv_bench.yaml -o answer',
            'version': '0.1.0', 'date': '2026-11-23 15:04 UTC',
            'inputs': {f'{name}.mcap': f'{k + 1:x}' * 64
                       for k, (name, _, _) in enumerate(recordings)}},
    }


def _series(rng, k, name, family, purpose, found) -> dict:
    t = np.arange(0.0, LASTING, PERIOD)
    speed = sum(0.4 / f * np.sin(2 * np.pi * f * t + k + 2 * f) for f in (0.3, 0.7, 1.9))
    angle = np.cumsum(speed) * PERIOD
    twist = 2e-4 * np.tanh(3 * speed) + 1e-4 * np.sin(angle)
    missing = 6.0 * np.exp(-np.abs(speed) / 0.15) * np.sign(speed)
    wrong = {'load_position': ('rad', 2e-6, angle, 1.2e-3 * np.sin(0.9 * t + 1)),
             'torsion': ('rad', 2e-6, twist, 8e-5 * np.tanh(2 * speed)),
             'current': ('A', 5e-3, 1.4 * speed + 0.4 * np.sign(speed), 0.05 * missing),
             'motor_torque': ('N m', 0.1, 30 * speed + missing, missing)}
    channels = {}
    for channel, (unit, noise, true, error) in wrong.items():
        rig = true + noise * rng.standard_normal(len(t))
        rig[200:202] = np.nan
        one = {'unit': unit, 'noise': noise, 'rig': rig.tolist(),
               'as_given': (true - error).tolist()}
        if found:
            one['augmented'] = (true - 0.2 * error).tolist()
        channels[channel] = one
    return {'recording': name, 'family': family, 'purpose': purpose, 't': t.tolist(),
            'channels': channels}


def _equations(rng, series, found) -> list[dict]:
    shown = []
    for one in series:
        t = np.array(one['t'])[::3]
        for name, unit, size in (('load', 'N m', 6.0), ('transmission', 'rad', 8e-5)):
            shape = np.sign(np.sin(1.9 * t)) * np.exp(-np.abs(np.sin(1.9 * t)))
            noise = 0.05 * size * rng.standard_normal(len(t))
            shown.append({'recording': one['recording'], 'equation': name, 'unit': unit,
                          't': t.tolist(), 'before': (size * shape + noise).tolist(),
                          'after': ((0.15 if found else 1.0) * size * shape + noise).tolist()})
    return shown


def _curve(rng) -> dict:
    x = np.linspace(-1.1, 1.1, 41)
    y = 6.2 * np.sign(x) * np.exp(-np.abs(x) / 0.15) + 22.0 * np.tanh(40 * x)
    half = 0.5 + 0.6 * np.abs(x)
    px = rng.uniform(-1.1, 1.1, 500)
    py = np.interp(px, x, y) + 0.8 * rng.standard_normal(len(px))
    return {'curve': {'variable': 'load_speed', 'unit': 'rad/s', 'y_unit': 'N m', 'x': x.tolist(),
                      'y': y.tolist(), 'low': (y - half).tolist(), 'high': (y + half).tolist()},
            'points': {'x': px.tolist(), 'y': py.tolist()}}


def _which(rng) -> list[dict]:
    return [
        {'effect': 'stribeck_friction', 'site': 'load', 'rung': 'law',
         'confidence': {'place': 0.99, 'mechanism': 0.96, 'curve': 0.93, 'law': 0.84},
         'mechanism': {'port': 'friction', 'site': 'load', 'variables': ['load_speed'],
                       'symmetry': 'odd', 'memory': False},
         'change': 'Friction on the load falls by 6.2 N m from standstill to 0.3 rad/s.',
         'law': True, **_curve(rng),
         'parameters': {'excess': {'value': 6.214, 'std': 0.21, 'unit': 'N m'},
                        'fade': {'value': 0.1503, 'std': 0.012, 'unit': 'rad/s'},
                        'shape': {'value': 1.0, 'std': None, 'unit': ''}},
         'shrink_predicted': 0.71, 'shrink_realised': 0.68, 'interval': [0.61, 0.74],
         'ambiguous_with': ['load_dependent_friction'],
         'alternatives': [{'effect': 'load_dependent_friction', 'site': 'mesh',
                           'confidence': 0.12, 'tell': 'A load step at standstill changes it, '
                                                       'Stribeck friction not.'}]},
        {'effect': 'backlash', 'site': 'mesh', 'rung': 'mechanism',
         'confidence': {'place': 0.97, 'mechanism': 0.83, 'curve': 0.4, 'law': 0.1},
         'mechanism': {'port': 'mesh', 'site': 'mesh', 'variables': ['torsion', 'torque'],
                       'symmetry': 'odd', 'memory': True},
         'law': None, 'curve': None,
         'parameters': {'gap': {'value': 8.1e-5, 'std': 6e-6, 'unit': 'rad'}},
         'shrink_predicted': 0.1, 'shrink_realised': 0.083, 'interval': [0.03, 0.12],
         'ambiguous_with': [], 'alternatives': []}]


def _report(rng, status, found, recordings) -> dict:
    gap = {'before': 0.448, 'as_given': 0.529, 'within_tolerance': 0.448, 'floor': 0.0142,
           'after': 0.112, 'shrink': 0.77, 'interval': [0.68, 0.81], 'solved': 0.81}
    if not found:
        gap |= {'after': 0.448, 'shrink': 0.0, 'interval': [0.0, 0.0], 'solved': 0.15}
    if status == 'no_gap':
        gap = {'before': 0.0149, 'as_given': 0.0153, 'floor': 0.0142, 'solved': 0.36}
    sentence = {
        'no_gap': 'The twin matches the rig within its tolerances and the noise of the sensors.',
        'explained': 'The load is missing Stribeck friction: 6.2 ± 0.4 N m at standstill. Adding '
                     'it removes 93 % of the error on unseen recordings.',
        'partly_explained': 'The load is missing Stribeck friction: 6.2 ± 0.4 N m at standstill. '
                            'Adding it removes 68 % of the error on unseen recordings.',
        'unknown': 'The load equation is off by 31 times the noise, and no effect of the '
                   'catalogue explains it.'}[status]
    remains = {
        'no_gap': '', 'explained': '7 % of the gap stays, close to the noise.',
        'partly_explained': '19 % of the gap stays, most of it in the transmission equation.',
        'unknown': '85 % of the gap stays, most of it in the load equation.'}[status]
    by_purpose = {p: [n for n, _, q in recordings if q == p]
                  for p in ('screen', 'accept', 'report')}
    return {
        'schema': 'servo_gap/2', 'servo': 'rv_bench', 'recordings': by_purpose,
        'channels': {
            'load_position': _channel('rad', 1.21e-3, 2.4e-4, 2e-6, found),
            'torsion': _channel('rad', 7.7e-5, 1.6e-5, 2e-6, found),
            'current': _channel('A', 0.0671, 0.0134, 5e-3, found),
            'motor_torque': _channel('N m', 1.34, 0.27, 0.1, found)},
        'where': [
            {'balance': 'controller', 'share': 0.0, 'gap_to_noise': 3.1e-5,
             'interval': [0, 0.1], 'verdict': 'at the noise floor'},
            {'balance': 'drive', 'share': 0.01, 'gap_to_noise': 3.02, 'interval': [2, 4],
             'verdict': 'gap'},
            {'balance': 'motor', 'share': 0.01, 'gap_to_noise': 1.1, 'interval': [0.8, 1.4],
             'verdict': 'at the noise floor'},
            {'balance': 'transmission', 'share': 0.11, 'gap_to_noise': 12.4,
             'interval': [9, 15], 'verdict': 'gap'},
            {'balance': 'load', 'share': 0.87, 'gap_to_noise': 31.2, 'interval': [25, 37],
             'verdict': 'at the noise floor' if status == 'no_gap' else 'gap'},
            {'balance': 'sensor', 'share': 0.0, 'gap_to_noise': 0.0, 'interval': [0, 0],
             'verdict': 'not observable'}],
        'which': _which(rng) if found else [], 'gap': gap,
        'verdict': {'status': status, 'balance': '' if status == 'no_gap' else 'load',
                    'sentence': sentence,
                    'effects': ['stribeck_friction', 'backlash'] if found else [],
                    'remains': remains},
        'unknown': {} if status in ('no_gap', 'explained') else {
            'balance': 'transmission', 'depends_on': ['load_angle'], 'parity': 'even',
            'orders': [161.0], 'memory': False, 'drift': True},
        'next_experiment': {
            'separates': ['stribeck_friction', 'load_dependent_friction'], 'family': 'load_steps',
            'settings': {'amplitude': 2.5, 'duration': 20.0},
            'command': 'servo-identify experiment load_steps --servo rv_bench --amplitude 2.5 '
                       '--duration 20 --reach travel=2 -o next.mcap',
            'expected': {'stribeck_friction': 'Friction is the same at 0 and at 40 N m.',
                         'load_dependent_friction': 'Friction grows by 1.4 N m at 40 N m.'}},
        'moved': [
            {'path': 'mechanism.stiffness', 'given': 5.0e5, 'found': 4.62e5, 'low': 4.0e5,
             'high': 6.0e5, 'sigma': -0.76},
            {'path': 'drive.torque_constant', 'given': 0.4878, 'found': 0.4951, 'low': 0.4634,
             'high': 0.5122, 'sigma': 0.6},
            {'path': 'mechanism.load_inertia', 'given': 5.76, 'found': 6.336, 'low': 5.184,
             'high': 6.336, 'sigma': 2.0}],
        'defaults': [{'path': 'sensors.current_sensor.noise', 'value': 0.005, 'unit': 'A'},
                     {'path': 'controller.type', 'value': 'none', 'unit': ''}],
        'equations': {'load': {'before': 31.2, 'after': 2.4},
                      'transmission': {'before': 12.4, 'after': 6.1}},
        'stability': {'splits': 20, 'named_in': {'stribeck_friction': 1.0, 'backlash': 0.85}},
        'findings': [
            {'level': 'green', 'sentence': 'Current and torque agree within 2 %.', 'action': ''},
            {'level': 'amber', 'sentence': 'The load inertia is hardly excited: the highest '
             'acceleration is 1.9 rad/s2.', 'action': 'Record a sweep up to 8 Hz.'}],
        'confirm': ['Turn the load by hand at 0.05 rad/s: 28 N m, and 23 N m at 0.5 rad/s.'],
        'warnings': ['The load inertia ends at its upper bound, 6.336 kg m2.'],
        'timing': {'reading': 1.9, 'check': 0.4, 'residuals': 6.2, 'selection': 21.7,
                   'simulation': 9.3},
    }


def _channel(unit, given, after, noise, found) -> dict:
    return {'unit': unit, 'rms_gap': given, 'as_given': given, 'within_tolerance': 0.8 * given,
            'augmented': after if found else 0.8 * given, 'noise_floor': noise, 'fit': 0.91}


def _correlations(rng) -> dict:
    names = ['mechanism.stiffness', 'drive.torque_constant', 'mechanism.load_inertia',
             'effects.coulomb.level', 'effects.stribeck.excess', 'effects.stribeck.fade',
             'effects.backlash.gap']
    mixed = rng.standard_normal((12, len(names)))
    mixed[:, 5] += 2.5 * mixed[:, 4]
    return {'names': names, 'matrix': np.corrcoef(mixed.T).tolist()}


PATCH = """\
--- rv_bench.yaml
+++ augmented.yaml
@@ -38,3 +38,6 @@
 effects:                        # name: {effect: from the catalogue, at: where, its parameters}
   coulomb: {effect: coulomb_friction, at: load, level: {value: 22.0, unit: N m}}
+  stribeck: {effect: stribeck_friction, at: load,
+    excess: {value: 6.214, unit: N m, std: 0.21}, fade: {value: 0.1503, unit: rad/s, std: 0.012}}
-  viscous: {effect: viscous_friction, at: load, slope: {value: 30.0, unit: N m s/rad}}
"""


def hostile_document() -> dict:
    """Return a document in which every name that a user can choose is hostile."""
    one = document()
    report = one['report']
    report['servo'] = report['verdict']['sentence'] = HOSTILE
    report['warnings'] = report['confirm'] = [HOSTILE]
    report['recordings'] = {HOSTILE: [HOSTILE]}
    report['moved'][0]['path'] = report['defaults'][0]['path'] = HOSTILE
    report['which'][0] |= {'effect': HOSTILE, 'site': HOSTILE, 'change': HOSTILE}
    report['which'][0]['curve'] |= {'variable': HOSTILE, 'y_unit': HOSTILE}
    report['findings'] = [{'level': HOSTILE, 'sentence': HOSTILE, 'action': HOSTILE}]
    report['next_experiment']['command'] = one['patch'] = HOSTILE
    report['where'].append({'balance': HOSTILE, 'verdict': 'gap', 'gap_to_noise': 3.0})
    one['correlations']['names'][0] = HOSTILE
    one['facts'] = {'command': HOSTILE, 'version': HOSTILE, 'inputs': {HOSTILE: HOSTILE}}
    first = one['series'][3]
    first |= {'recording': HOSTILE, 'family': HOSTILE, 'purpose': '__proto__'}
    channel = first['channels']['torsion']
    first['channels'] = {'steps': channel, HOSTILE: {**channel, 'unit': HOSTILE}}
    one['equations'] = [{**one['equations'][0], 'recording': HOSTILE, 'equation': HOSTILE}]
    return one
