"""A short record of a first-order model, for the tests of bands and projections."""

import numpy as np

U = np.array([1.0, -0.6, 0.8, 1, -1, 0.7, -0.9, 0.5, 1, -0.8, 0.6, -1, 0.9, 0.8, -0.7, 1])
BOUND = 0.05
