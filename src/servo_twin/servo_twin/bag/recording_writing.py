"""Recordings and answers of any length written as bags, part by part."""

from __future__ import annotations

from pathlib import Path
from typing import Self

from ..recording.recording import Predictions, Recording
from .bag_topics import COUPLED_COLUMN, sample_topics, Samples, TWIN_TOPICS
from .bag_writing import BagError, BagWriter, nanoseconds


class RecordingWriter:
    """
    Writes the parts of one recording, and what a twin answered to them, as a bag.

    A context manager, as BagWriter is. ``coupled`` says whether the recording has the angle of
    another axis. Parts follow each other; but for the last they fill blocks of ``block_size``, or
    a message is shorter. Columns keep every bit; the start is kept to 1 ns. Raises BagError when
    ``path`` exists.
    """

    def __init__(self, path: Path | str, block_size: int = 100, namespace: str = '',
                 coupled: bool = False) -> None:
        self._bag = BagWriter(path, namespace)
        self._block, self._coupled = block_size, coupled
        self._first: Recording | None = None

    @property
    def path(self) -> Path:
        """Folder of the bag."""
        return self._bag.path

    def add(self, part: Recording, answer: Predictions | None = None) -> None:
        """Write the next part, and its answer beside it."""
        if self._first is None:
            self._first = part.part(part.sequence, part.sequence)
            self._bag.write_info(
                nanoseconds(part.start), servo=part.servo, servo_file=part.servo_file,
                family=part.family, replicate=part.replicate, note=part.note)
        topics = sample_topics(part, self._coupled)
        if answer is not None:
            topics |= _answer_topics(answer)
        self._bag.write_samples(
            topics, start=nanoseconds(self._first.start), period=part.period,
            sequence=self._first.sequence, block_size=self._block,
            first=part.sequence - self._first.sequence)

    def __enter__(self) -> Self:
        self._bag.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self._bag.__exit__(*error)


def _answer_topics(answer: Predictions) -> dict[str, Samples]:
    return {
        TWIN_TOPICS['prediction'][0]: Samples(
            'Prediction', answer.prediction, {'restarts': answer.restarts}),
        TWIN_TOPICS['residual'][0]: Samples(
            'Residual', answer.residual,
            {'channel_noise': answer.channel_noise, 'balance_noise': answer.balance_noise})}


def write_recording(path: Path | str, recording: Recording, block_size: int = 100,
                    namespace: str = '') -> Path:
    """
    Write a recording as a bag and return its path.

    Raises BagError when ``path`` exists or the recording is empty.
    """
    if not len(recording):
        raise BagError(f'{recording.name}: a recording without samples makes no bag')
    with RecordingWriter(path, block_size, namespace, recording.has(COUPLED_COLUMN)) as bag:
        bag.add(recording)
    return bag.path


def write_predictions(path: Path | str, predictions: Predictions, recording: Recording,
                      block_size: int = 100, namespace: str = '') -> Path:
    """Write the twin's answer to ``recording``, with that recording's samples beside it."""
    with RecordingWriter(path, block_size, namespace, recording.has(COUPLED_COLUMN)) as bag:
        bag.add(recording, predictions)
    return bag.path
