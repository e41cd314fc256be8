"""The live view: one page in the browser, of a running rig and its twin or of a bag."""
