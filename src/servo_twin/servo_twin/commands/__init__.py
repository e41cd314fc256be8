"""The subcommands of `servo-twin`, one module each."""
