"""What the learners of friction see of each sample."""

FEATURES = ('speed', 'acceleration', 'current')
