"""Signatures on disk: asked for again they are read, and never those of something else."""

import numpy as np
import pytest
from test_gap import FEW, recorded, SERVO

from servo_identify.gap import library
from servo_identify.gap.balance import Balance
from servo_identify.gap.candidates import candidates_of, extend
from servo_identify.gap.library import build_library
from servo_identify.gap.observation import observe
from servo_identify.gap.stack import Stack

CHANNELS = ('motor_position', 'load_position', 'torque', 'current')


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Keep the signatures of a test apart, with the compiled kernels of all others."""
    from servo_identify.gap import signature_cache
    monkeypatch.setattr(signature_cache, 'cache_folder', lambda: tmp_path)
    return tmp_path


def stacked(seed=1, without=FEW):
    """Return the stack of one recording, and all candidates at their first shape."""
    extended = extend(SERVO, ('motor', 'load'), CHANNELS, without)
    seen = observe([recorded(SERVO, seed)], SERVO)
    stack = Stack([Balance(extended.servo, one, extended.given) for one in seen], extended)
    return stack, candidates_of(extended, lambda effect, site: [
        {name: effect.parameters[name].default for name in effect.shapes()}])


def built(stack, candidates):
    return build_library(stack, candidates, lambda share: None)


def refuse(*arguments):
    raise AssertionError('a signature was computed again')


def test_a_second_diagnosis_reads_what_the_first_computed(folder, monkeypatch):
    stack, candidates = stacked()
    first = built(stack, candidates)
    monkeypatch.setattr(library, '_scaled', refuse)
    second = built(stack, candidates)
    assert [c.key for c in second.candidates] == [c.key for c in first.candidates]
    for one, other in zip(first.tables, second.tables, strict=True):
        np.testing.assert_array_equal(one, other)


def test_another_recording_has_signatures_of_its_own(folder, monkeypatch):
    stack, candidates = stacked()
    built(stack, candidates)
    monkeypatch.setattr(library, '_scaled', refuse)
    with pytest.raises(AssertionError, match='computed again'):
        built(*stacked(seed=2))


def test_a_file_that_was_cut_short_is_computed_anew(folder):
    stack, candidates = stacked()
    first = built(stack, candidates)
    for file in folder.rglob('*.npz'):
        file.write_bytes(file.read_bytes()[:100])
    second = built(stack, candidates)
    np.testing.assert_array_equal(first.tables[0], second.tables[0])


def test_the_oldest_sets_go(folder, monkeypatch):
    from servo_identify.gap import signature_cache
    monkeypatch.setattr(signature_cache, 'SETS', 1)
    for seed in (1, 2):
        built(*stacked(seed))
    assert len([f for f in (folder / 'signatures').iterdir() if f.is_dir()]) == 1
