"""Pages: dot patterns by wire and column, and the page that a head prints from them."""
