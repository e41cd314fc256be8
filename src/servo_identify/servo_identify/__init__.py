"""Identification of the servo twin from recordings and diagnosis of its gap."""
