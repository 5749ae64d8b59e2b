"""Steps that give an equivalent problem: ``apply`` makes it, the result carries answers back."""
