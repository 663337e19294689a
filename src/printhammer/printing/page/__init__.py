"""Pages: patterns of wires and columns, and the page that a head prints of them."""
