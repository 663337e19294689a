"""Integration methods, and finding where a step meets a switch."""
