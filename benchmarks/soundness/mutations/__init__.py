"""Changed certificate files, and an oracle in fractions that says which accepted claims are false."""
