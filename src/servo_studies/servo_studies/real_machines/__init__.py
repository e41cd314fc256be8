"""Identification of real machines from published recordings, beside what was published."""
