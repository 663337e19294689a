"""Laws of the ribbon and paper pack."""
