"""Pictures of printed pages, quality and tolerance."""
