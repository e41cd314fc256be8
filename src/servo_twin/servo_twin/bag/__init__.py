"""
Bags of recordings: the only package that knows how they are laid out.

A bag is a rosbag2 directory with MCAP storage. Messages of constant size are read and written as
columns, thousands at a time; what rosbag2 tools do with such a bag is the same as ever.
"""

from .bag_reading import (
    namespaces,
    open_predictions,
    open_recording,
    OpenPredictions,
    OpenRecording,
    read_predictions,
    read_recording,
)
from .bag_topics import Samples
from .bag_writing import BagError, BagWriter
from .event_reading import read_changes, read_events
from .recording_writing import RecordingWriter, write_predictions, write_recording

__all__ = [
           'BagError',
           'BagWriter',
           'OpenPredictions',
           'OpenRecording',
           'RecordingWriter',
           'Samples',
           'namespaces',
           'open_predictions',
           'open_recording',
           'read_changes',
           'read_events',
           'read_predictions',
           'read_recording',
           'write_predictions',
           'write_recording',
]
