"""Mechanisms that a twin may lack: what each adds to the equations, whatever its formula."""
