"""The parts of the Hammerstein study of the clutch (`smid.theses.clutch.hammerstein_study`)."""
