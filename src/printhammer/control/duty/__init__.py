"""How fast a coil may be fired before it is too hot."""
