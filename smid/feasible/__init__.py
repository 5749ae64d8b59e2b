"""The feasible set: a model, its data and its noise bounds as one polynomial problem."""
