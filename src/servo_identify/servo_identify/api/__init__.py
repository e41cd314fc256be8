"""The front door in Python: what `import servo_identify as si` offers."""
