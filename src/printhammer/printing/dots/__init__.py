"""Dots: what is fired and when, how dots are judged, and how the hammer settles after them."""
