"""
The blind check: the emulated rig with effects withheld, against the diagnosis.

`machines.yaml` and `faults.yaml` say what is checked, `severities.yaml` how strong, `plans.yaml`
with which seeds. The rig is only ever run as a command, its recordings are imported as any others.
"""
