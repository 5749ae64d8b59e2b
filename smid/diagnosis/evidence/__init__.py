"""What the data and the residuals show before any cause is named."""
