"""A hammer: its constants, its file and its statics."""
