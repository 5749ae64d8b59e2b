"""The look of results: text, tables, HTML and figures. Every other room may print and draw with it."""
