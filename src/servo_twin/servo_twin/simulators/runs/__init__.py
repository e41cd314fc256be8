"""One excitation, run by the twin, by MuJoCo and by the equation of a joint."""
