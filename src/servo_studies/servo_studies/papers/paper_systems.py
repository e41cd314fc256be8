"""
The systems of the five papers, and what each paper reached on its own rig.

What is known of a paper stands here; what this suite reaches is never written here but comes from
figures that a part of the results measured, see :mod:`.paper_comparison`.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec

BENCH = ('bench', 'learners')
"""The parts whose page is that of the bench of paper 000, docs/results.md."""

WRITTEN = ('fmu', 'linear_forms')
"""The parts whose page, docs/PART.md, is written by hand: the comparison links it, no more."""


@dataclass(frozen=True)
class System:
    """
    One line of the comparison.

    ``paper`` its number, ``part`` of the results that measures it here, ``name`` the system,
    ``figure`` what the paper reached ('' where it gives no number).
    """

    paper: str
    part: str
    name: str
    figure: str


SYSTEMS = (
    System('000', 'bench', 'RV bench in open loop: table 4, figure 11',
           'mean R of the hybrid 0.921 (sine) and 0.956 (square), traditional 0.853 and 0.887'),
    System('000', 'bench', 'RV bench, friction over angle and speed: table 1, figures 4 and 5',
           'MAE 0.123 N m forward, 0.083 reverse; MAPE 0.32 % and 0.18 %'),
    System('000', 'bench', 'RV bench, backlash over angle and load: table 2, figures 6 and 7',
           'MAE 0.0039 arcmin, MAPE 0.26 %'),
    System('000', 'bench', 'RV bench, transmission error: eq. 12, figures 8 to 10',
           'MSE 0.00073 arcmin2 forward, 0.00162 reverse'),
    System('000', 'bench', 'RV bench, velocity loop, 10 deg/s at 1 Hz: figure 12',
           'ripple and dead zone seen, no number'),
    System('000', 'bench', 'RV bench, torque over the turn, 3 deg/s: figure 13',
           'unevenness kept, no number'),
    System('000', 'bench', 'RV bench, reversal under 0, 30 and 60 N m: figure 14',
           'lag grows with load, no number'),
    System('001', 'feed_drive', 'feed drive, analytical model of one axis: table 3',
           'RMSE 2.83, 3.15, 3.84, 4.89 um at F2000 to F5000'),
    System('001', 'feed_drive', 'feed drive, hybrid model of one axis: table 3',
           'RMSE 2.33, 1.72, 1.41, 1.64 um at F2000 to F5000'),
    System('001', 'feed_drive', 'feed drive, circle on two axes: table 4',
           'largest contour error, hybrid 6.57, 5.34, 4.10, 6.95 um at 60 to 120 rad/min, '
           'analytical 7.19, 8.62, 10.26, 12.54'),
    System('001', 'feed_drive', 'feed drive, SVPWM inverter, switching: figure 6', ''),
    System('001', 'fmu', 'mechanism brought as a model of another tool (Modelica there)', ''),
    System('002', 'ema_bench', 'EMA bench, frequency and phase of the command recovered', ''),
    System('002', 'ema_bench', 'EMA bench, backlash over the carrier setting: figure 5.1', ''),
    System('002', 'ema_bench', 'EMA bench, position: figures 5.4 and 5.5',
           'standard error 0.008 % of the signal at worst'),
    System('002', 'ema_bench', 'EMA bench, speed: figures 5.7 and 5.8',
           'standard error 0.019 % of the signal at worst'),
    System('002', 'ema_bench', 'EMA bench, current: figures 5.10 and 5.11',
           'standard error 0.157 % of the signal at worst'),
    System('002', 'ema_bench', 'EMA bench, time of model over time of bench',
           'named its weakness, number not legible'),
    System('003', 'geared_dc', 'geared DC motor, friction by LSTM: table 2',
           'RMSE 0.012 N m, MAE 0.009 N m, R2 0.982'),
    System('003', 'geared_dc', 'geared DC motor, FNN, CNN, transformer, SINDy, PINN',
           'named, no number'),
    System('003', 'geared_dc', 'geared DC motor, classical friction laws: table 3',
           'accuracy "moderate", no number'),
    System('003', 'learners', 'all learners on the RV bench, where a torque sensor gives friction',
           ''),
    System('004', 'pan_tilt', 'pan and tilt, step of 5 V: figures 8 and 9', 'curves, no number'),
    System('004', 'pan_tilt', 'pan and tilt, slow sine of 3 V: figures 10 and 11',
           'curves; the linear model misses the plateau at standstill'),
    System('004', 'pan_tilt', 'pan and tilt, five models of the harmonic drive: eq. 3 to 7',
           'named; only the first was run, without friction'),
    System('004', 'pan_tilt', 'pan and tilt, two axes, azimuth inertia over elevation',
           'named, not modelled'),
    System('004', 'linear_forms',
           'pan and tilt, transfer function and state space: figures 6 and 7',
           'one model, in LabVIEW'),
)


def machines() -> tuple[str, ...]:
    """
    Return the parts that have a page of their own, in the order of the papers.

    A part of :data:`SYSTEMS` is one as soon as there is a module (or package) of its name beside
    this one. It has::

        make(work, pictures, told) -> dict       figures ready for JSON; keeps recordings in the
                                                 folder work, draws into pictures, and tells
                                                 told(what, share) how far it is
        page(figures) -> str                     the text of docs/PART.md; not of WRITTEN
        comparison_rows(figures) -> list[dict]   rows of docs/comparison.md, see comparison.Row
    """
    parts = dict.fromkeys(system.part for system in SYSTEMS)
    return tuple(part for part in parts if part not in BENCH and find_spec(
        f'{__package__}.{part}') is not None)
