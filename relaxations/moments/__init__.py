"""Relaxations: moment matrices (Lasserre), the parametric lift, and the conic programs they become."""
