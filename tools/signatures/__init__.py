"""The page docs/symptoms.md and its sketches: what each effect looks like in a recording."""
