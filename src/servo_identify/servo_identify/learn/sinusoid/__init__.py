"""A sinusoid recovered from a record alone: frequency by the spectrum, then least squares."""

from .sinusoid_recovery import recovered, Sinusoid, SinusoidError

__all__ = ['Sinusoid', 'SinusoidError', 'recovered']
