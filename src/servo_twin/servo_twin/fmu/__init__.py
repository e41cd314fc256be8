"""Mechanisms that come as an FMU. FMPy is imported only when a servo file names one."""
