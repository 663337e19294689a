"""Candidates judged by the claims, and how often claims hold by chance."""
