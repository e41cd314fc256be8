"""Data in: tables, units, mappings, even time grids."""
