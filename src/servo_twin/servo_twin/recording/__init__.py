"""What was recorded: columns in SI units, blocks of samples, and how topics join to them."""
