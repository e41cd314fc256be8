"""The subcommands of `servo-identify` that belong to studies."""
