"""Work for the running rig: jobs in processes of their own, the models in use, what was heard."""
