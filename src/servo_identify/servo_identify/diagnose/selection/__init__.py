"""Which set of mechanisms explains the residuals."""
