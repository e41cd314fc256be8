"""The ways in which a twin runs beside its rig."""

LIVE_MODES = ('measured_input', 'closed_loop', 'observer')
"""Those that need nothing but the past, the usual one first; `forced_current` looks one ahead."""
