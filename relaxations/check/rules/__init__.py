"""The rules of inference, one module each. The head of each module proves that the rule is sound."""
