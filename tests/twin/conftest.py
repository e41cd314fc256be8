"""The graph of a twin node is there for all tests of the twin."""

from twin_graph import graph, rig, servo_files, shared_twin

__all__ = ['graph', 'rig', 'servo_files', 'shared_twin']
