"""Pages: patterns of wires and columns, lettering and fonts, and the page that a head prints of them."""
