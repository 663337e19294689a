"""Helper functions without physics: roots, threads, tables, files and declarations of constants."""
