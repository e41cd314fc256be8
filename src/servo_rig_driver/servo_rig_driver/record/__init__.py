"""The recorder, which writes bags, and the player, which sends set-points."""
