"""How results look: text, tables, HTML, and the style of figures. Everything above may print and draw."""
