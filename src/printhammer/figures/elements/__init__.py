"""What the figures share: style, scales, marks, files."""
