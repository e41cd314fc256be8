"""
Where a simulation starts, estimated by itself: by a horizon's first part, then by all of it.

An encoder does not give the speed at the edge of a recording well. Over a whole horizon the path
of a shaft that catches in detents branches, and has no slope that leads back to the right start.
Over its first part the path has not branched yet.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...fit.fit_problem import Problem
from ...fit.free_values import NOTHING_FREE
from ...fit.levenberg_marquardt import solved
from ...fit.segments import Course, LEAST
from ...fit.shooting import Shooting, Unknowns

FIRST = 0.1
"""Share of a horizon that its start is estimated from first."""

STEPS = 2
"""Steps of that estimate."""


def of_starts(shooting: Shooting) -> tuple[Problem, np.ndarray]:
    """Return the problem of the starts alone, and which recordings have both encoders."""
    problem = Problem(shooting, NOTHING_FREE, False, False)
    problem.be_modest()
    both, problem.zeroed = problem.zeroed, np.zeros(0, dtype=int)  # the torsion is centred instead
    return problem, both


def stepped(problem: Problem, unknowns: Unknowns, steps: int) -> Unknowns:
    """Return the unknowns after some steps of the starts."""
    held = np.ones(problem.size, dtype=bool)
    return solved(problem, unknowns, steps, 0.0, held, lambda *_: None)[0]


def soon(shooting: Shooting, unknowns: Unknowns) -> Unknowns:
    """Return the unknowns with the starts that the first part of each horizon shows."""
    first = Shooting(shooting.servo, [_first(one) for one in shooting.courses], shooting.mode,
                     shooting.on)
    try:
        return stepped(of_starts(first)[0], unknowns, STEPS)
    finally:
        first.close()


def _first(course: Course) -> Course:
    """Return the first part of each horizon."""
    lengths = course.stops - course.starts
    some = np.minimum(lengths, np.maximum(LEAST, (FIRST * lengths).astype(int)))
    return replace(course, stops=course.starts + some)
