"""The subcommands of `servo-identify`, one module each."""
