"""Work side by side: on this machine, on a cluster, beside a running rig."""
