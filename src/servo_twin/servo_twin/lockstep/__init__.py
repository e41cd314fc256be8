"""The twin in lockstep with samples: predictions at once, residuals when they are due."""
