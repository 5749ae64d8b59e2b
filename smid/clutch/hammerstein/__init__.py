"""The parts of the Hammerstein study of the clutch (`smid.clutch.hammerstein_study`)."""
