"""Friction learned from recordings: the balance, the learners, the table that compares them."""
