"""Tables of numbers in text files, as written by people, spreadsheets and instruments."""
