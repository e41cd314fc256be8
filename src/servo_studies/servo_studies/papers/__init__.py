"""The result of paper 000 on the emulated bench, and figures on recordings of real machines."""
