"""Results of the reconstruction that ship with the package; `studies/reconstruction` computes them."""
