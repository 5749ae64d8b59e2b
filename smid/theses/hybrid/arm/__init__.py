"""The rotating arm: its exact motion, and the hybrid thesis's methods to estimate its unknown parts."""

from smid.theses.hybrid.arm.alternating import Alternation, alternate
from smid.theses.hybrid.arm.arm_study import (
    SHAPES,
    ArmStudy,
    NetworkRuns,
    alternating_runs,
    arm_study,
    input_error_runs,
    shape_of,
)
from smid.theses.hybrid.arm.embedded_arm import (
    embedded_arm,
    embedded_error,
    figure_6_9,
    friction_curve,
    random_start,
    true_friction,
)
from smid.theses.hybrid.arm.embedded_study import (
    COMPARED,
    WAYS,
    EmbeddedRuns,
    EmbeddedStudy,
    Way,
    embedded_study,
    run_embedded,
)
from smid.theses.hybrid.arm.exact_motion import ARM, exact_motion
from smid.theses.hybrid.arm.friction_start import certified_start, friction_start, white_start
from smid.theses.hybrid.arm.global_start import global_start, multistart_start
from smid.theses.hybrid.arm.input_error import (
    InputError,
    Motion,
    estimate_by_input_error,
    modulate_motion,
    quiet_filter,
)
from smid.theses.hybrid.arm.proven import is_told, prove_arm
from smid.theses.hybrid.arm.records import held_record, other_kind, slower, thesis_record
from smid.theses.hybrid.arm.white import (
    INTEGRATIONS,
    TABLE_F2_START,
    WhiteEstimate,
    estimate_white,
    white_arm,
    white_free_run,
)

__all__ = [
    "ARM",
    "COMPARED",
    "INTEGRATIONS",
    "SHAPES",
    "TABLE_F2_START",
    "WAYS",
    "Alternation",
    "ArmStudy",
    "EmbeddedRuns",
    "EmbeddedStudy",
    "InputError",
    "Motion",
    "NetworkRuns",
    "Way",
    "WhiteEstimate",
    "alternate",
    "alternating_runs",
    "arm_study",
    "certified_start",
    "embedded_arm",
    "embedded_error",
    "embedded_study",
    "estimate_by_input_error",
    "estimate_white",
    "exact_motion",
    "figure_6_9",
    "friction_curve",
    "friction_start",
    "global_start",
    "held_record",
    "input_error_runs",
    "is_told",
    "modulate_motion",
    "multistart_start",
    "other_kind",
    "prove_arm",
    "quiet_filter",
    "random_start",
    "run_embedded",
    "shape_of",
    "slower",
    "thesis_record",
    "true_friction",
    "white_arm",
    "white_free_run",
    "white_start",
]
