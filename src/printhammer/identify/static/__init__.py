"""Constants of one part from static tables and rebounds."""
