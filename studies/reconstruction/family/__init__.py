"""The family of clearly different hammers, and the conclusions that hold for all of them."""
