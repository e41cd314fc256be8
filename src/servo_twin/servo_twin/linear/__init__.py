"""Linear forms of a servo: state space, transfer functions, and responses that were measured."""
