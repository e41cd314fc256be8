"""The choices of a fit: what is learned, how the twin is driven, how residuals are weighted."""

LEARNED = ('physical', 'friction', 'backlash', 'transmission_error', 'current_loop',
           'presliding', 'residual', 'deviation')
INPUT_OF = {'measured_input': 'voltage', 'closed_loop': None, 'forced_current': 'current',
            'forced_motion': 'motor_position'}
"""The ways to drive the twin, each with the column that it takes for its input."""
WEIGHTS = ('noise', 'residual', 'whitened')
