"""What the studio computes and shows of a state."""
