"""Networks beside a physical model."""
