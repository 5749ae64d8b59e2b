"""Free runs of a model on measured records: fits, scores, comparison of models, and tests of the residuals."""

from smid.validation.compare import Comparison, compare
from smid.validation.fit import ModelFit, fit
from smid.validation.residuals import Residuals, residuals
from smid.validation.scores import Validation
from smid.validation.validate import validate

__all__ = ["Comparison", "ModelFit", "Residuals", "Validation", "compare", "fit", "residuals", "validate"]
