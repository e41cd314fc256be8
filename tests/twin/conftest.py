"""The graph of a twin node is there for all tests of the twin."""

from twin_graph import graph, servo_files

__all__ = ['graph', 'servo_files']
