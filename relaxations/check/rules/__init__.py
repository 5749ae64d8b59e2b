"""The rules of inference, one a file. The head of each file proves that the rule is sound."""
