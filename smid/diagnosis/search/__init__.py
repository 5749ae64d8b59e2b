"""The search for causes: effects are fitted, compared, and added one after the other."""
