"""The circuit of the coil: what a current probe shows of it, and its constants from such records."""
