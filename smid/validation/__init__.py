"""Free runs of a model on measured records: scores, comparison of models, and tests of the residuals."""

from smid.validation.compare import Comparison, compare
from smid.validation.residuals import Residuals, residuals
from smid.validation.validate import Validation, validate

__all__ = ["Comparison", "Residuals", "Validation", "compare", "residuals", "validate"]
