"""Evidence in data and residuals, before any cause is named."""
